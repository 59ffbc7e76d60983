"""What a search leaves in its folder: designs, history, page; the experiments of the thesis."""

__all__: list[str] = []
