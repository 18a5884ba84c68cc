"""Small KRL programs, construct by construct: text of the .src, of the .dat, and what is to come out."""

from dataclasses import dataclass, field

HOME = "{A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}"
AT_HOME = [0, -90, 90, 0, 0, 0]
TO = "{A1 50,A2 -70,A3 80,A4 0,A5 30,A6 0}"
AT = [50, -70, 80, 0, 30, 0]
DAT = f"""\
&ACCESS RVP
DEFDAT cycle PUBLIC
;FOLD EXTERNAL DECLARATIONS;%{{PE}}
EXT BAS (BAS_COMMAND :IN,REAL :IN )
;ENDFOLD
DECL E6AXIS XHOME={HOME}
DECL E6AXIS XP1={{A1 50,A2 -70,A3 80,A4 0,A5 30,A6 0,E1 0.0,E2 0.0}}
DECL E6AXIS XP2={{A1 -20,A2 -60,A3 100,A4 40,A5 0,A6 0}}
DECL PDAT PDEFAULT={{VEL 100.000,ACC 100.000,APO_DIST 100.000}}
DECL PDAT PPDAT1={{VEL 60.0,ACC 100.0,APO_DIST 50.0,APO_MODE #CDIS}}
DECL FDAT FHOME={{TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE}}
DECL FDAT FP1={{TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}
DECL INT COUNT=2
ENDDAT
"""


@dataclass(frozen=True)
class Case:
    """A program and what is to come out.

    Attributes:
        body: What stands between DEF and END, or the whole .src if that has a DEF.
        positions: Start and targets of the moves. [deg]
        percents: Their speed limits; any if not given. [%]
        radii_mm: Their zones; any if not given.
        waits_s: Waits of the program.
        notes: What one of the notes says, in order.
        unknown: How many operations of unknown length there are.
        dat: Text of the .dat; none if empty.
        robot: Whether a robot is needed.
    """

    body: str
    positions: list[list[float]]
    percents: list[float] | None = None
    radii_mm: list[float] | None = None
    waits_s: list[float] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    unknown: int = 0
    dat: str = ""
    robot: bool = False


def inline(name: str, percent: float = 100, *, data: str = "PDEFAULT", kind: str = "PTP", cont: bool = False) -> str:
    """An inline form of the older style."""
    blend, short = (" CONT", " C_PTP") if cont else ("", "")
    return (
        f";FOLD {kind} {name}{blend} Vel= {percent:g} % {data[1:]} Tool[1] Base[0];%{{PE}}%R 5.4.37,%MKUKATPBASIS,"
        f"%CMOVE,%VPTP,%P 1:{kind}, 2:{name}, 3:{short.strip()}, 5:{percent:g}, 7:{data[1:]}\n"
        f"$BWDSTART=FALSE\nPDAT_ACT={data}\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,{percent:g})\nPTP X{name}{short}\n;ENDFOLD\n"
    )


def spline(name: str, percent: float = 100, data: str = "PDEFAULT") -> str:
    """An inline form of the newer style."""
    return (
        f";FOLD SPTP {name} Vel={percent:g} % {data[1:]} Tool[1] Base[0] ;%{{PE}}\n"
        f";FOLD Parameters ;%{{h}}\n;Params IlfProvider=kukaroboter.basistech.inlineforms.movement.spline; "
        f"Kuka.PointName={name}; Kuka.VelocityPtp={percent:g}; Kuka.CurrentCDSetIndex=0; IlfCommand=SPTP\n;ENDFOLD\n"
        f"SPTP X{name} WITH $VEL_AXIS[1] = SVEL_JOINT({percent:.1f}), $TOOL = STOOL2(FP1), $BASE = SBASE(FP1.BASE_NO), "
        f"$APO = SAPO_PTP({data}), $GEAR_JERK[1] = SGEAR_JERK({data})\n;ENDFOLD\n"
    )


CASES = {
    "literal targets": Case(f"PTP {HOME}\nPTP {TO}", [AT_HOME, AT], [100]),
    "any case": Case(f"ptp {HOME}\nPtp {{a1 30}}", [AT_HOME, [30, -90, 90, 0, 0, 0]]),
    "E6AXIS with its type": Case(f"PTP {{E6AXIS: {HOME[1:]}\nPTP {{AXIS: A1 10}}", [AT_HOME, [10, -90, 90, 0, 0, 0]]),
    "partial aggregates": Case(
        f"PTP {HOME}\nPTP {{A4 10}}\nPTP {{A1 5,A3 80}}", [AT_HOME, [0, -90, 90, 10, 0, 0], [5, -90, 80, 10, 0, 0]]
    ),
    "relative": Case(
        f"PTP {HOME}\nPTP_REL {{A1 10}}\nPTP_REL {{A1 10,A4 -5}}",
        [AT_HOME, [10, -90, 90, 0, 0, 0], [20, -90, 90, -5, 0, 0]],
    ),
    "external axes that stand": Case("PTP XP1\nPTP XP2", [AT, [-20, -60, 100, 40, 0, 0]], dat=DAT),
    "an external axis that moves": Case(
        "PTP XP1\nPTP {A1 20,E1 100}\nPTP {A1 0}",
        [AT, [0, -70, 80, 0, 30, 0]],
        notes=["external axis"],
        unknown=1,
        dat=DAT,
    ),
    "comments are not code": Case(f";PTP {TO}\nPTP {HOME} ;PTP {TO}\nPTP {{A1 9}}", [AT_HOME, [9, -90, 90, 0, 0, 0]]),
    "semicolons in texts": Case(
        f'DECL CHAR T[9]\nT[]="a;b"\nPTP {HOME}\nPTP {{A1 9}}', [AT_HOME, [9, -90, 90, 0, 0, 0]]
    ),
    "inline forms": Case(
        inline("HOME") + inline("P1", 80) + inline("P2", 40),
        [AT_HOME, AT, [-20, -60, 100, 40, 0, 0]],
        [80, 40],
        dat=DAT,
    ),
    "newer inline forms": Case(spline("HOME") + spline("P1", 55), [AT_HOME, AT], [55], dat=DAT),
    "the code counts, not the fold": Case(
        inline("HOME") + inline("P1", 80).replace("PARAMS,80", "PARAMS,70"), [AT_HOME, AT], [70], dat=DAT
    ),
    "modal speeds": Case(
        f"PTP {HOME}\nBAS(#VEL_PTP,50)\nPTP {{A1 9}}\nPTP {{A1 0}}\nBAS (#VEL_PTP , 20)\nPTP {{A1 9}}",
        [AT_HOME, [9, -90, 90, 0, 0, 0], AT_HOME, [9, -90, 90, 0, 0, 0]],
        [50, 50, 20],
    ),
    "motion data": Case("PDAT_ACT=PPDAT1\nBAS(#PTP_DAT)\nPTP XHOME\nPTP XP1", [AT_HOME, AT], [60], dat=DAT),
    "speeds of axes in a loop": Case(
        f"INT I\nFOR I=1 TO 6\n$VEL_AXIS[I]=25\nENDFOR\nPTP {HOME}\nPTP {{A1 9}}",
        [AT_HOME, [9, -90, 90, 0, 0, 0]],
        [25],
    ),
    "arithmetic": Case(
        f"DECL E6AXIS P\nP={HOME}\nPTP P\nP.A2=P.A2+15\nP.A1=2*(10-3)/4\nPTP P", [AT_HOME, [3, -75, 90, 0, 0, 0]]
    ),
    "a counted loop": Case(
        f"INT I\nPTP {HOME}\nFOR I=1 TO 3\nPTP_REL {{A1 5}}\nENDFOR\nPTP {HOME}",
        [AT_HOME, [5, -90, 90, 0, 0, 0], [10, -90, 90, 0, 0, 0], [15, -90, 90, 0, 0, 0], AT_HOME],
        notes=["3 times"],
    ),
    "a loop downwards": Case(
        f"INT I\nPTP {HOME}\nFOR I=2 TO 1 STEP -1\nPTP {{A1 I}}\nENDFOR",
        [AT_HOME, [2, -90, 90, 0, 0, 0], [1, -90, 90, 0, 0, 0]],
    ),
    "while and repeat": Case(
        f"INT N\nPTP {HOME}\nN=0\nWHILE N<2\nN=N+1\nPTP {{A1 N}}\nENDWHILE\nREPEAT\nN=N-1\nPTP {{A1 N}}\nUNTIL N==0",
        [AT_HOME, [1, *AT_HOME[1:]], [2, *AT_HOME[1:]], [1, *AT_HOME[1:]], AT_HOME],
    ),
    "a loop that is left": Case(
        f"INT N\nN=0\nPTP {HOME}\nWHILE TRUE==TRUE\nN=N+1\nIF N>2 THEN\nEXIT\nENDIF\nPTP {{A1 N}}\nENDWHILE",
        [AT_HOME, [1, *AT_HOME[1:]], [2, *AT_HOME[1:]]],
    ),
    "branches on constants": Case(
        f"PTP {HOME}\nIF COUNT==2 THEN\nPTP {{A1 9}}\nELSE\nPTP {{A1 8}}\nENDIF\n"
        "SWITCH COUNT\nCASE 1\nPTP {A1 7}\nCASE 2,3\nPTP {A1 6}\nDEFAULT\nPTP {A1 5}\nENDSWITCH",
        [AT_HOME, [9, *AT_HOME[1:]], [6, *AT_HOME[1:]]],
        dat=DAT,
    ),
    "a branch that nobody knows": Case(
        f"PTP {HOME}\nPTP {TO}\nIF $IN[3] THEN\nPTP {{A1 9}}\nENDIF\nPTP {TO}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["whether this runs is not known"],
        unknown=1,
    ),
    "a branch without motions": Case(
        f"PTP {HOME}\nIF $IN[3] THEN\n$OUT[1]=TRUE\nENDIF\nPTP {TO}", [AT_HOME, AT], notes=["it is kept"]
    ),
    "the main loop": Case(f"PTP {HOME}\nLOOP\nPTP {TO}\nPTP {HOME}\nENDLOOP", [AT_HOME, AT, AT_HOME]),
    "a main loop that begins elsewhere": Case(
        f"PTP {HOME}\nPTP {TO}\nLOOP\nPTP {{A1 9}}\nPTP {{A1 0}}\nENDLOOP",
        [[0, -70, 80, 0, 30, 0], [9, -70, 80, 0, 30, 0], [0, -70, 80, 0, 30, 0]],
        notes=["is the cycle"],
    ),
    "a main loop that ends elsewhere": Case(
        f"PTP {HOME}\nLOOP\nPTP {TO}\nPTP {HOME}\ngo_away()\nENDLOOP",
        [AT, AT_HOME],
        notes=["the first motion starts at an unknown position", "GO_AWAY() is not in this file"],
        unknown=1,
    ),
    "subprograms": Case(
        f"DEF main( )\nPTP {HOME}\ngo(10)\ngo(20)\nEND\nDEF go(angle:IN)\nREAL angle\nPTP {{A1 angle}}\nEND\n",
        [AT_HOME, [10, *AT_HOME[1:]], [20, *AT_HOME[1:]]],
        notes=["2 times"],
    ),
    "a program elsewhere": Case(
        f"PTP {HOME}\nPTP {TO}\ngripper(1)\nPTP {TO}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["GRIPPER() is not in this file", "starts at an unknown position"],
        unknown=1,
    ),
    "routines of the controller": Case(
        f"PTP {HOME}\nSET_CD_PARAMS (0)\nINTERRUPT ON 3\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\nPTP {TO}",
        [AT_HOME, AT],
    ),
    "waits": Case(
        f"PTP {HOME}\nPTP {TO}\nWAIT SEC 0.5\nWAIT SEC 2*0.25\nPTP {HOME}", [AT_HOME, AT, AT_HOME], waits_s=[0.5, 0.5]
    ),
    "waits for signals": Case(
        f"PTP {HOME}\nPTP {TO}\nWAIT FOR $IN[3] AND NOT $IN[4]\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["WAIT FOR $IN[3] AND NOT $IN[4]"],
        unknown=1,
    ),
    "blending in millimetres": Case(
        f"$APO.CDIS=50\nPTP {HOME}\nPTP {TO} C_DIS\nPTP {{A1 9}} C_PTP C_DIS\nPTP {HOME}",
        [AT_HOME, AT, [9, *AT[1:]], AT_HOME],
        radii_mm=[50, 50, 0],
    ),
    "motion data with a distance": Case(
        inline("HOME") + inline("P1", data="PPDAT1", cont=True) + inline("P2") + f"$APO.CPTP=50\nPTP {HOME}",
        [AT_HOME, AT, [-20, -60, 100, 40, 0, 0], AT_HOME],
        radii_mm=[50, 0, 0],
        dat=DAT,
    ),
    "a blend before a wait": Case(
        f"$APO.CDIS=50\nPTP {HOME}\nPTP {TO} C_DIS\nWAIT SEC 0.1\nPTP {HOME} C_DIS",
        [AT_HOME, AT, AT_HOME],
        radii_mm=[0, 0],
        waits_s=[0.1],
    ),
    "what is not understood": Case(
        f"PTP {HOME}\nFOO BAR 3\nPTP {TO}", [AT_HOME, AT], notes=["not understood and kept: FOO BAR 3"]
    ),
    "a motion that is not understood": Case(
        f"PTP {HOME}\nPTP {TO}\nLIN @@@\nPTP {TO}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["the motion is not understood: LIN @@@"],
        unknown=1,
    ),
    "a point that is elsewhere": Case(
        f"PTP {HOME}\nPTP {TO}\nPTP XP9\nPTP {TO}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["XP9 is not in the program's files"],
        unknown=1,
    ),
    "a computed target": Case(
        f"PTP {HOME}\nPTP {TO}\nPTP {{A1 $ANIN[1]}}\nPTP {TO}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["computed while the program runs"],
        unknown=1,
    ),
    "the present position": Case(f"PTP $AXIS_ACT\nPTP {HOME}\nPTP {TO}", [AT_HOME, AT]),
    "a jump": Case(f"PTP {HOME}\nPTP {TO}\nGOTO weiter\nweiter:\nPTP {HOME}", [AT_HOME, AT], notes=["GOTO"], unknown=1),
    "no END, no DEF": Case(f"PTP {HOME}\nPTP {TO}", [AT_HOME, AT]),
    "a place of the tool": Case(
        "BAS(#INITMOV,0)\nPTP " + HOME + "\nPTP {X 1173,Y 0,Z 1500,A 0,B 90,C 0,S 2,T 2}\nPTP " + HOME,
        [AT_HOME, None, AT_HOME],
        robot=True,
    ),  # type: ignore[list-item]
    "home as a place": Case(
        "BAS(#INITMOV,0)\nPTP " + TO + "\nPTP {X 1173,Y 0,Z 1650,A 0,B 90,C 0,S 2,T 2}", [AT, AT_HOME], robot=True
    ),
    "without a configuration": Case(
        "BAS(#INITMOV,0)\nPTP {A1 1,A2 -80,A3 80,A4 1,A5 1,A6 1}\nPTP {X 1173,Y 0,Z 1650,A 0,B 90,C 0}",
        [[1, -80, 80, 1, 1, 1], [0, -90, 90, 1, 0, -1]],
        notes=["no configuration is given"],
        robot=True,
    ),
    "a tool in the file": Case(
        "$BASE=$NULLFRAME\n$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\nPTP "
        + TO
        + "\nPTP {X 1273,Y 0,Z 1650,A 0,B 90,C 0,S 2,T 2}",
        [AT, AT_HOME],
        robot=True,
    ),
    "a tool by its number": Case(
        "BASE_DATA[1]={X 100,Y 0,Z 0}\nTOOL_DATA[3]={X 0,Y 0,Z 100,A 0,B 0,C 0}\nBAS(#TOOL,3)\nBAS(#BASE,1)\n"
        + "PTP "
        + TO
        + "\nPTP {X 1173,Y 0,Z 1650,A 0,B 90,C 0,S 2,T 2}",
        [AT, AT_HOME],
        robot=True,
    ),
    "a tool that is elsewhere": Case(
        "BAS(#INITMOV,0)\nBAS(#TOOL,3)\nPTP "
        + TO
        + "\nPTP {A1 0}\nPTP {X 1173,Y 0,Z 1650,A 0,B 90,C 0,S 2,T 2}\nPTP "
        + TO
        + "\nPTP {A1 0}",
        [AT, [0, *AT[1:]], [0, *AT[1:]]],
        notes=["TOOL_DATA[3] is not in the file"],
        unknown=1,
        robot=True,
    ),
    "geometric operator": Case(
        "BAS(#INITMOV,0)\nPTP " + TO + "\nPTP {X 1073,Y 0,Z 1650,A 0,B 90,C 0}:{X 0,Y 0,Z 100,A 0,B 0,C 0,S 2,T 2}",
        [AT, AT_HOME],
        robot=True,
    ),
    "linear": Case(
        f"BAS(#INITMOV,0)\n$VEL.CP=0.5\nPTP {TO}\nLIN_REL {{Z -100}}\nLIN_REL {{Z 100}}",
        [AT, None, AT],
        notes=["the linear motion keeps its speed"],
        robot=True,
    ),  # type: ignore[list-item]
    "linear in the tool": Case(
        f"BAS(#INITMOV,0)\n$VEL.CP=0.5\nPTP {HOME}\nLIN_REL {{Z 50}} #TOOL\nLIN_REL {{Z -50}} #TOOL",
        [AT_HOME, None, AT_HOME],
        robot=True,
    ),  # type: ignore[list-item]
    "linear at an unknown speed": Case(
        f"BAS(#INITMOV,0)\nPTP {HOME}\nPTP {TO}\nLIN_REL {{Z -100}}\nPTP {HOME}",
        [AT_HOME, AT, AT_HOME],
        notes=["does not say how fast"],
        unknown=1,
        robot=True,
    ),
    "a circle": Case(
        "BAS(#INITMOV,0)\n$VEL.CP=0.2\nPTP "
        + HOME
        + "\nCIRC {X 1173,Y 100,Z 1550,A 0,B 90,C 0},{X 1173,Y 0,Z 1450,A 0,B 90,C 0}\nPTP "
        + HOME,
        [AT_HOME, None, AT_HOME],
        notes=["the circular motion is kept", "the arm meets a singularity"],
        robot=True,
    ),  # type: ignore[list-item]
}

LOADS = """\
LOAD_DATA[1]={M 4.5,CM {X 0,Y 0,Z 80,A 0,B 0,C 0},J {X 0.1,Y 0.1,Z 0.05}}
BAS(#TOOL,1)
PTP XHOME
LOOP
PTP XP1
$LOAD={M 9,CM {X 0,Y 0,Z 100},J {X 0,Y 0,Z 0}}
PTP XP2
$LOAD=LOAD_DATA[1]
PTP XHOME
ENDLOOP
"""
