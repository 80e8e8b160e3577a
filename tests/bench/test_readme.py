"""README.md's chart of the peers shows today's measurements."""

from pathlib import Path

from PIL import Image

from bench import common, figures

ROOT = Path(__file__).resolve().parent.parent.parent


def test_readme_shows_the_chart_of_the_peers():
    readme = (ROOT / "README.md").read_text()
    assert "](docs/peers.png)" in readme and "](docs/results.md)" in readme
    bars = figures.peers(common.read_result("size"))
    assert set(bars) == {*figures.PEERS, *figures.PUBLISHED}
    with Image.open(ROOT / "docs" / "peers.png") as picture:
        assert picture.text[common.DIGEST] == common.digest(bars)


def test_readme_claims_a_thirteenth_of_the_raw_size():
    """The first paragraph rounds the chart's figures."""
    readme = (ROOT / "README.md").read_text()
    assert "in about a 13th of the raw size" in " ".join(readme.split())
    as_file, on_gpu = figures.peers(common.read_result("size"))["ours"]
    assert 12.5 <= as_file < 13.5 and 12.5 <= on_gpu < 13.5


def test_peers_are_medians_over_the_papers_models():
    def row(model, ratio):
        return {"model": model, "codecs": {"ours": {"ratio": ratio, "resident_ratio": 2 * ratio}}}

    models = [row("bunny", 1), row("dragon", 2), row("suzanne", 9), row("igea", 100)]
    measured = figures.peers({"models": models})
    assert {name: bars for name, bars in measured.items() if name not in figures.PUBLISHED} == {
        "ours": [2, 4]
    }
