//! The paper's studies on the bundled sample, as their own tables.

use super::bed::Bed;
use std::path::Path;

const STUDIES: [&str; 10] = [
    "complexity",
    "robustness",
    "operators",
    "threshold",
    "weights",
    "init",
    "budget",
    "switches",
    "counting",
    "truth",
];

/// The lines of a run's `table.md` that are a table.
pub(crate) fn tables_of(run: &Path) -> String {
    let text = std::fs::read_to_string(run.join("table.md")).unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    lines.join("\n")
}

pub(crate) fn section(bed: &Bed) -> String {
    let sample = Bed::own("samples/walk");
    let tables = STUDIES.map(|name| {
        let run = bed.study(name, &sample, &format!("study-{name}"), &[]);
        format!("### {name}\n\n{}\n", tables_of(&run))
    });
    format!(
        "`study NAME samples/walk --out RUN`: a walker, 28 frames. Beside data of MMVR, HuPR and XRF55 a table has the paper's figures \
         too; the paper's are of a network that reads PPPR, these of the fit itself.\n\n{}",
        tables.join("\n")
    )
}
