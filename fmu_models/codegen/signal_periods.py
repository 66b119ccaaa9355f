"""How often the periodic signals of a model repeat, as formulas that an FMU holds for this suite.

    {"ramp": {"period": "1/f", "rates": {"f": "-1/f"}}}

Rates are d(log period)/d of each parameter. No variable of the FMU says either, for importers need only the next event.
"""

import json

import sympy
from sympy.printing.numpy import NumPyPrinter

from fmu_models.lowering.hybrid_system import HybridSystem


def signal_periods(system: HybridSystem) -> str:
    """The text of that file."""
    printer = NumPyPrinter({"fully_qualified_modules": False, "precision": 17})  # as ``Formula`` reads it
    periods = {signal.name: signal.period for signal in system.signals}
    return json.dumps(
        {
            name: {
                "period": printer.doprint(period),
                "rates": {
                    str(p): printer.doprint(sympy.diff(period, p) / period)
                    for p in sorted(period.free_symbols, key=str)
                },
            }
            for name, period in periods.items()
        }
    )
