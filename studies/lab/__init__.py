"""What makes and proves the evidence: programs of the checkout alone, each started by `python -m studies.lab.NAME`.

They use the packages as any program outside does, by their public names; nothing imports them, and no wheel holds them.
"""
