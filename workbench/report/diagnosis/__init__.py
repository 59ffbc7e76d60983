"""What a diagnosis leaves in its folder: model, answer, compared motions, page."""

__all__: list[str] = []
