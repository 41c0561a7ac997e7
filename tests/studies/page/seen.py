"""What a reader of report.html sees."""


def column(page, number: int) -> list[str]:
    """Cells of a column of the table of cases, counted from 1, in the rows that are shown."""
    return page.locator(f"#cases tbody tr:visible > :nth-child({number})").all_inner_texts()
