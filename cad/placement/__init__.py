"""Where camera, mirrors and anchors go on a hull: candidates, ranked, built and checked, with the reasons."""
