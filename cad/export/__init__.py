"""The mount as files: for the printer, the workshop, the assembler and the simulator."""
