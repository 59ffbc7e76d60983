"""What an identification leaves on disk: model, page and figures; the line of a motor."""

__all__: list[str] = []
