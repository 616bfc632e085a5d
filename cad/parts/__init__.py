"""Parts of the mount: fold bracket, gimbal, servos, screws and mirrors."""
