from er_il.support import resources
from er_il.support.resources import data_dir


def test_the_checkout_comes_first():
    assert (data_dir("datasets") / "reach_cup.yaml").is_file()
    assert not (data_dir("datasets") / "__init__.py").exists()  # it would shadow Hugging Face's datasets


def test_an_installed_package_uses_its_own_copy_not_the_neighbouring_library(tmp_path, monkeypatch):
    (tmp_path / "datasets").mkdir()  # Hugging Face's library, which lives next to er_il in site-packages
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path / "er_il")
    assert data_dir("datasets") == tmp_path / "er_il" / "_data" / "datasets"
