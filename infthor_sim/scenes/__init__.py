"""Building worlds: procedural rooms, recorded floor plans, ProcTHOR houses."""
