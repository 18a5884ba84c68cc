"""What pages hold."""

import json
import re


def held(page: str) -> dict:
    """What a page holds."""
    return json.loads(re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[0])
