"""What the name of a column says of its role, in English, German, French, Italian and Spanish."""

import re
import unicodedata

from rig_io.logs.columns import COLUMNS

EXACT, CLEAR, FAINT = 0.95, 0.7, 0.35

_DRIVE = (
    r"drive|driv|antrieb|treib|motor|moteur|motore|entrain|menant|azion|traino|accion|impuls?or|belt|band|rolle|roller"
)
_ENCODER = (
    r"encoder|geber|drehgeber|inkrement|codeur|codificador|pulse|impuls|count|zahler|zaehler|compteur|contatore|contador"
    r"|ticks?\b|inc\b"
)
_SPEED = r"speed|drehzahl|geschwind|vitesse|veloc|rpm|omega|winkelgeschw|u min|tacho"
_NORMAL = r"normal|\bf ?n\d?\b|^n\b|anpress|presskraft|preload|clamp"
_ACROSS = r"friction|reib|frott|attrit|rozam|tangent|\bf ?[tr]\b"  # a force along the border, which is no normal force
_WARM = r"temp(?!s\b|o)|thermo|celsius|fahrenheit|\bpt ?100\d?\b|^t (room|raum|amb|disc|cont|sens|oil|\d)"
_EDGE = r"edge|flank|front|flanc|flanco|fronte"
_WORDS: tuple[tuple[str, str, float], ...] = (
    (
        "time",
        r"^(time|zeit|temps|tempo|tiempo|t|timestamp|zeitstempel|datum|date|uhrzeit|heure|ora|hora|x ?value)\b",
        CLEAR,
    ),
    ("time", r"time|zeit|temps|tiempo|datum|uhrzeit|stamp|sekund|second|horodat|x value", 0.5),
    ("laser", r"laser|telemet|lase\b", CLEAR),
    ("laser", r"weg|abstand|distan|displac|verschieb|deplac|sposta|desplaz|triang|\bdist\b", 0.55),
    ("angle", r"angle|winkel|angol|angul|theta|phi\b|rotation|verdreh", CLEAR),
    ("tachometer", r"tacho|tachymet|tachimet|tacomet|gyro|kreisel|giroscop", CLEAR),
    ("vibrometer", r"vibromet|doppler|\bldv\b", CLEAR + 0.1),
    ("load", r"load|kraft|force|forza|fuerza|last\b|charge|carico|carga|waage|kmd|dms", CLEAR),
    ("load", _NORMAL, CLEAR + 0.1),
    ("temperature", _WARM, CLEAR + 0.1),
    ("temperature", r"^t$", FAINT),
    ("trigger", r"trigger|sync|synchron|declench|disparo|innesco|marke", CLEAR),
)
ROWS = re.compile(r"^(unnamed \d+|index|nr|no|row|zeile|ligne|riga|fila|sample|lfd ?nr)$")


def plain(name: str) -> str:
    """A name in small letters without accents."""
    spread = unicodedata.normalize("NFKD", name.lower().replace("ß", "ss"))
    return "".join(c for c in spread if not unicodedata.combining(c))


def named(name: str) -> dict[str, float]:
    """Roles that a name speaks for, with how clearly (0 to 1)."""
    if name in COLUMNS:
        return {name: EXACT}
    text = _words(name)
    if ROWS.fullmatch(text):
        return {}
    weights: dict[str, float] = {}
    drive = re.search(_DRIVE, text) is not None
    # of the driving disc: 1 where a 2, or a word for the second, stands alone
    disc = 1 if re.search(r"(?<![\d.])2(?![\d.])|links|left|second|zweit", text) else 0
    if re.search(_EDGE, text):
        weights[f"drive{disc}_edge_time" if drive else "encoder_edge_time"] = CLEAR
        return weights
    if drive:
        if re.search(_SPEED, text):
            return {f"drive{disc}_speed": CLEAR + 0.1}
        if re.search(_ENCODER, text):
            return {f"drive{disc}_count": CLEAR + 0.1}
        return {f"drive{disc}_count": FAINT, f"drive{disc}_speed": FAINT}
    for role, words, weight in _WORDS:
        if re.search(words, text):
            full = f"load{disc}" if role == "load" else role
            weights[full] = max(weights.get(full, 0.0), weight)
    if re.search(_ENCODER, text):
        weights["encoder_count"] = CLEAR
    elif re.search(_SPEED, text):
        weights[f"drive{disc}_speed"] = FAINT
    if "encoder_count" in weights:
        weights.pop("angle", None)
    if weights.get("temperature", 0.0) > FAINT:
        weights = {"temperature": weights["temperature"]}
    if re.search(_ACROSS, text) and not re.search(_NORMAL, text):
        weights = {"friction": FAINT}  # no role of a column, and so a word against any
    return weights


def unit_named(name: str, role: str) -> str | None:
    """Unit that a name says outright for a role, `motor_rpm`; None where it says none."""
    return "rpm" if COLUMNS[role].unit == "rad/s" and re.search(r"\brpm\b", _words(name)) else None


def _words(name: str) -> str:
    return re.sub(r"[_\W]+", " ", plain(name)).strip()
