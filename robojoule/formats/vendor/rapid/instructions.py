"""Instructions of RAPID that move nothing, by their names in capitals."""

WAITS = {"WAITDI", "WAITDO", "WAITAI", "WAITAO", "WAITGI", "WAITGO", "WAITUNTIL", "WAITROB", "WAITSYNCTASK"}
WAITS |= {"WAITLOAD", "WAITWOBJ", "WAITTESTANDSET", "UIMSGBOX", "TPREADFK", "TPREADNUM", "TPREADDNUM", "SYNCMOVEON"}
# Instructions that move nothing and take no time to speak of.
HARMLESS = {"SET", "RESET", "SETDO", "SETGO", "SETAO", "PULSEDO", "INVERTDO", "TPWRITE", "TPERASE", "TPSHOW", "ADD"}
HARMLESS |= {"INCR", "DECR", "CLEAR", "CLKSTART", "CLKSTOP", "CLKRESET", "SINGAREA", "ERRWRITE", "WRITE"}
HARMLESS |= {
    "OPEN",
    "CLOSE",
    "LOAD",
    "UNLOAD",
    "STARTMOVE",
    "IENABLE",
    "IDISABLE",
    "ISIGNALDI",
    "ISIGNALDO",
    "IDELETE",
}
HARMLESS |= {"IWATCH", "ISLEEP", "CONNECT", "ITIMER", "TRIGGIO", "TRIGGEQUIP", "TRIGGINT", "RETRY"}
HARMLESS |= {
    "MOTIONSUP",
    "SOFTACT",
    "SOFTDEACT",
    "TUNESERVO",
    "TUNERESET",
    "CORRCON",
    "CORRWRITE",
    "ACTUNIT",
    "PATHRESOL",
}
HARMLESS |= {"DEACTUNIT", "WZHOMEJOINTDEF", "WZLIMSUP", "BOOKERRNO", "TRYNEXT", "SYNCMOVEOFF", "ENDSYNC", "SETSYSDATA"}
# What acts on all motions behind it and is not simulated.
NOT_SIMULATED = {
    "PATHACCLIM": "accelerations are those of the robot",
    "WORLDACCLIM": "accelerations are those of the robot",
}
NOT_SIMULATED |= {"SPEEDREFRESH": "speeds are those at an override of 100 %", "SPEEDLIMAXIS": "it bounds speeds"}
HARMLESS |= set(NOT_SIMULATED)
CHANGING = {"ADD", "INCR", "DECR", "CLEAR"}  # the value of their first argument
