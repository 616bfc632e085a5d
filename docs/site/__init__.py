"""The manual as a site: `./run docs` gathers pages, notebooks and generated references, and has Sphinx build them."""
