"""What stands on the studio's page, a panel in a module: inputs to the studio, results from it."""
