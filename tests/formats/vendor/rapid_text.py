"""Small RAPID modules."""

from robojoule.formats.vendor.rapid.program import read_rapid
from robojoule.formats.vendor.trace import Beside, Load, Motion

NONE = "[9E9,9E+09,9E9,9E9,9E9,9E9]"
DATA = f"""\
  CONST jointtarget jHome:=[[0,0,0,0,30,0],{NONE}];
  CONST jointtarget j1:=[[60,20,10,0,40,0],{NONE}];
  CONST jointtarget j2:=[[90,40,-10,20,50,60],{NONE}];
  CONST robtarget p10:=[[600,300,500],[0,0,2,0],[0,-1,0,1],{NONE}];
  PERS tooldata tGrip:=[TRUE,[[0,0,100],[1,0,0,0]],[5,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata wTable:=[FALSE,TRUE,"",[[100,0,0],[1,0,0,0]],[[0,0,10],[0.5,0,0,0.5]]];
"""
CYCLE = """\
    MoveAbsJ jHome\\NoEOffs,v5000,fine,tGrip;
    MoveAbsJ j1\\NoEOffs,v5000,fine,tGrip; ! to the part
    MoveAbsJ j2,v7000,fine,tGrip;
    WaitTime 0.5;
    MoveAbsJ jHome\\NoEOffs,v3000,fine,tGrip;"""
ROBOT = "kuka_kr16_r2010_2"  # its axes stand for those of any arm that the pendant counts as its model does


def module(body, data=DATA, more=""):
    head = "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\nMODULE Cycle\n"
    return f"{head}{data}  PROC main()\n{body}\n  ENDPROC\n{more}ENDMODULE\n"


def written(tmp_path, text, name="cycle.mod"):
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return tmp_path / name


def events(tmp_path, body, beside=None, **more):
    trace = read_rapid(written(tmp_path, module(body, **more))).trace(beside or Beside())
    return list(trace.events), [str(note) for note in trace.notes]


def motions(found):
    return [event for event in found if isinstance(event, Motion)]


def kinds(found):
    return [type(event) for event in found if not isinstance(event, Load)]
