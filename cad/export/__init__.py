"""The mount as files: for the printer, the workshop, the assembler and the simulator."""

from cad.export.mount import export_mount

__all__ = ["export_mount"]
