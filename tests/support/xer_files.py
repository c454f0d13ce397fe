"""Writer of small Primavera exchange files (XER), for tests of the reader."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

HEADER = "ERMHDR\t19.12\t2026-03-01\tProject\tadmin\tplanner\tdbxDatabaseNoName\tProject Management\tEUR"


def table(name: str, columns: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table; ``columns`` are separated by blanks."""
    lines = [f"%T\t{name}", "\t".join(("%F", *columns.split()))]
    return lines + ["\t".join(("%R", *row)) for row in rows]


def xer_text(
    tasks: Sequence[tuple[str, str, str, str, str]],
    links: Sequence[tuple[str, str, str]] = (),
    memos: Mapping[str, str] | None = None,
    fields: Mapping[str, str] | None = None,
) -> str:
    """Return a file of one project with the parts 'Level 1' (id 11) and 'Level 2' (id 12).

    Args:
        tasks: Id, id of the part, name, start, finish.
        links: Id of the task before, id of the one that waits, kind such as ``PR_FS``.
        memos: Note by task.
        fields: Text of a field of one's own by task.
    """
    lines = [
        HEADER,
        *table(
            "PROJECT", "proj_id proj_short_name clndr_id plan_start_date", [["1", "TOWER", "1", "2026-03-09 07:00"]]
        ),
        *table(
            "CALENDAR",
            "clndr_id default_flag clndr_name clndr_type day_hr_cnt week_hr_cnt month_hr_cnt year_hr_cnt clndr_data",
            [["1", "Y", "Site", "CA_Base", "8", "40", "172", "2000", ""]],
        ),
        *table(
            "PROJWBS",
            "wbs_id proj_id seq_num proj_node_flag wbs_short_name wbs_name parent_wbs_id",
            [
                ["10", "1", "1", "Y", "TOWER", "Tower", ""],
                ["11", "1", "2", "N", "L1", "Level 1", "10"],
                ["12", "1", "3", "N", "L2", "Level 2", "10"],
            ],
        ),
        *table(
            "TASK",
            "task_id proj_id wbs_id clndr_id task_type status_code task_code task_name target_start_date "
            "target_end_date target_drtn_hr_cnt",
            [
                [number, "1", wbs, "1", "TT_Task", "TK_NotStart", f"A{number}", name, start, finish, "8"]
                for number, wbs, name, start, finish in tasks
            ],
        ),
        *table(
            "TASKPRED",
            "task_pred_id task_id pred_task_id proj_id pred_proj_id pred_type lag_hr_cnt",
            [[str(900 + n), then, first, "1", "1", kind, "0"] for n, (first, then, kind) in enumerate(links)],
        ),
    ]
    if memos:
        lines += table("TASKMEMO", "memo_id task_id task_memo", [[f"8{t}", t, memo] for t, memo in memos.items()])
    if fields:
        lines += table(
            "UDFTYPE", "udf_type_id table_name udf_type_label logical_data_type", [["5", "TASK", "IFC", "FT_TEXT"]]
        )
        lines += table("UDFVALUE", "udf_type_id fk_id proj_id udf_text", [["5", t, "1", v] for t, v in fields.items()])
    return "\r\n".join((*lines, "%E", ""))
