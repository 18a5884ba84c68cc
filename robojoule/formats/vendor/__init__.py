"""Programs in the languages of robot vendors: read as what the robot does, written with new speeds and waits.

A vendor's package parses its files and runs them as far as constants reach (`VendorProgram.trace`); what comes out is
the same for all vendors (`robojoule.formats.vendor.trace`). `robojoule.formats.vendor.resolution` makes an operation
tree of it for a robot, and `robojoule.formats.vendor.source` writes a changed tree back as edits of the text, for which
the package says where speeds and waits stand. Numbers know their place in the text (`robojoule.formats.vendor.values`),
so a speed that is set far from its motion is found again.
"""
