"""How far an algorithm goes, drawn: each bar from where to where, by the numbers of the verdict."""

from matplotlib.colors import to_hex

from rtec.cli import main
from rtec.report.figures_margin import draw_bands
from rtec.report.figures_style import figure_style, new_figure
from rtec.report.palette import ALARM
from rtec.verify.contract.frequencies import Does, Frequencies

ROWS = ((1e3, Does.INSERTS), (20e3, Does.INSERTS), (21e3, Does.PASSES), (1e6, Does.PASSES), (1.02e6, Does.FAILS))


def test_bars_reach_from_the_first_frequency_of_a_band_to_the_first_of_the_next():
    with figure_style():
        axes = new_figure(2.0).add_subplot()
        draw_bands(axes, 3.0, Frequencies(rows=(*ROWS, (2e6, Does.FAILS))), "#0072b2")
    bars = axes.patches
    assert [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in bars] == [
        (1e3, 21e3), (21e3, 1.02e6), (1.02e6, 2e6)
    ]  # fmt: skip
    assert [bar.get_y() + bar.get_height() / 2.0 for bar in bars] == [3.0] * 3
    assert [bar.get_hatch() for bar in bars] == [None, None, "////"]
    assert bars[0].get_alpha() > 2.0 * bars[1].get_alpha()
    assert (to_hex(bars[0].get_facecolor()), to_hex(bars[2].get_edgecolor())) == ("#0072b2", ALARM)


def test_check_draws_its_margin_and_says_where_there_is_none(tmp_path, capsys):
    file = tmp_path / "margin.png"
    assert main(["check", "original", "--timing", "8051", "--tries", "16", "--margin-figure", str(file)]) == 0
    assert f"margin_figure: {file}" in capsys.readouterr().out
    assert file.read_bytes().startswith(b"\x89PNG")
    assert main(["check", "original", "--tries", "16", "--margin-figure", str(file)]) == 2
    assert "--force" in capsys.readouterr().err
    words = ["check", "original", "--stream", "00 1us:+ 9us:end", "--margin-figure", str(tmp_path / "other.png")]
    assert main(words) == 2
    assert "does not go with --stream" in capsys.readouterr().err
