"""The commands, one module per command or small family; `mirrorgaze.cli.COMMANDS` lists them."""
