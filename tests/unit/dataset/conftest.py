import pytest

from rtec.dataset.load import load_dataset


@pytest.fixture
def load(tmp_path):
    """Load a file of the given text."""

    def loaded(text, name="x.csv", **options):
        file = tmp_path / name
        file.write_text(text)
        return load_dataset(file, **options)

    return loaded
