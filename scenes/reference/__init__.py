"""The reference renderer: stock Mitsuba `volpathmis` on the scene of the fast renderer, to judge that one."""
