"""The liver of `liver_incised`, cut downwards for a second while the retractor pulls."""

from dataclasses import replace

from studies.scene.library.liver_incised import CUT_AT, LIVER_INCISED

CUT_END = 3.0  # s

LIVER_CUT_LIVE = replace(
    LIVER_INCISED,
    name="liver_cut_live",
    title="Liver held at its bare area, its left tip pulled 20 mm to the left, its left lobe cut downwards for 1 s",
    cuts=(replace(LIVER_INCISED.cuts[0], at=CUT_AT, until=CUT_END, along=(0.0, 0.0, -1.0)),),
)
