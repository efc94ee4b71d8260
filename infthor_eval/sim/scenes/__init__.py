"""Building worlds: procedural rooms, recorded floor plans, ProcTHOR houses."""

__all__: list[str] = []
