"""The page and the figure of a beam as it was bent."""

__all__: list[str] = []
