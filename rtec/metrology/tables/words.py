"""Words of the headings in other people's files, in the languages that such files are met in.

Accents are taken off and letters made small before a word is looked up (`plain_words`).
"""

from __future__ import annotations

import re
import unicodedata


def _set(text: str) -> frozenset[str]:
    return frozenset(text.split())


DEVIATION = _set(
    "deviation deviations dev error errors err abweichung abweichungen abw positionsabweichung lageabweichung "
    "fehler delta difference diff differenz ecart erreur errore scostamento desviacion odchylka residual xij"
)
ACTUAL = _set(
    "actual act measured meas measurement measurements ist istwert istposition istpos messwert gemessen mesure "
    "mesuree misurato misura medido reading readings laser lasread interferometer feedback fbk encoder pij"
)
TARGET = _set(
    "target targets command commanded cmd nominal nom soll sollwert sollposition sollpos vorgabe zielposition "
    "ziel setpoint demand demanded programmed consigne cible theoretical teorico nominale nominell pi"
)
POSITION = _set(
    "position positions pos stellung weg coordinate coordinates koordinate location posizione posicion angle "
    "winkel poz"
)
DIRECTION = _set(
    "direction dir richtung approach anfahrrichtung fahrtrichtung bewegungsrichtung messrichtung sens senso "
    "sentido sense"
)
RUN = _set(
    "run runs lauf messlauf durchlauf zyklus cycle cycles repeat repetition wiederholung messreihe serie "
    "series pass trial iteration rep reps wdh cyc sweep lap fahrt traverse loop durchgang"
)
TIME = _set("time zeit timestamp elapsed uhrzeit temps tempo tiempo date datum datetime zeitstempel messzeit")
TEMPERATURE = _set("temperature temp temperatur temperatura temperatures tair tmat airtemp mattemp lufttemp")
OTHERS = {
    "velocity": _set("velocity vel speed geschwindigkeit drehzahl vitesse velocita velocidad"),
    "feed": _set("feed feedrate vorschub avance avanzamento"),
    "force": _set("force kraft vorschubkraft forza"),
    "current": _set("current strom motorstrom courant corrente"),
    "voltage": _set("voltage spannung volt"),
    "torque": _set("torque moment drehmoment couple"),
    "pressure": _set("pressure druck luftdruck pression airpress"),
    "humidity": _set("humidity feuchte luftfeuchte luftfeuchtigkeit feuchtigkeit humidite"),
}
AXIS = _set("axis axes achse achsen axe asse eje")
STATISTIC = _set(
    "mean average avg mittel mittelwert std stdev stddev sigma min max minimum maximum range spannweite median "
    "count uncertainty unsicherheit limit tolerance toleranz repeatability reversal umkehrspanne trend fit "
    "fitted model rms"
)
"""Of what was computed from readings: such columns are no readings."""
ANOTHER_ERROR = _set(
    "straightness geradheit yaw roll flatness ebenheit squareness horizontal vertical lateral following flag code "
    "compensation compensated correction corrected kompensation korrektur corrige"
)
"""Of errors that are no deviation of a position along its axis."""
FILLERS = _set(
    "axis axes achse x y z a b c u v w of the in linear lin machine maschine value values val wert werte raw "
    "data daten rotary positioning position pos along point punkt no nr number num and und i j k n p motor air "
    "luft material mat rel relative abs absolute total measuring stage table tool accuracy at by to de la le "
    "der die des point punkte st nd rd th"
)
FORWARD = _set(
    "forward forwards forth fwd fw positive positiv pos plus up upward outward ascending asc increasing avanti ida "
    "vor vorwarts vorw hin aufwarts "
    "steigend hinlauf aller cw + ↑ → ⇒ avant f"
)
BACKWARD = _set(
    "backward backwards bwd bw back reverse rev reversed negative negativ neg minus down downward descending desc "
    "indietro vuelta "
    "decreasing ruck ruckwarts ruckw zuruck her abwarts fallend rucklauf retour ccw return - − – ↓ ← ⇐ "
    "arriere r"
)

_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_WORD = re.compile(r"[a-z]+|[0-9]+|[+\-−–↑↓→←⇒⇐]")


def plain(text: str) -> str:
    """Return a text in small letters without accents; ``ß`` becomes ``ss``, ``µ`` becomes ``u``.

    Examples
    --------
    >>> plain("Écart (µm)"), plain("Rückwärts")
    ('ecart (um)', 'ruckwarts')
    """
    taken_apart = unicodedata.normalize("NFKD", text.replace("µ", "u").replace("ß", "ss"))
    return "".join(sign for sign in taken_apart if not unicodedata.combining(sign)).replace("μ", "u").lower()


def plain_words(text: str) -> list[str]:
    """Return the words, numbers and signs of a heading, as `plain` spells them.

    Examples
    --------
    >>> plain_words("LinearError X-Achse"), plain_words("Lauf 2 ↑")
    (['linear', 'error', 'x', '-', 'achse'], ['lauf', '2', '↑'])
    """
    return _WORD.findall(plain(_CAMEL.sub(" ", text)))
