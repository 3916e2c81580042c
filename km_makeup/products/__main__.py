"""``python -m km_makeup.products``: the commands of the product library, without Blender."""

import sys

from .commands import main

sys.exit(main())
