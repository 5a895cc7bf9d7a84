//! The table as Markdown, for reports and terminals.

use super::StudyKind;
use super::journal::Rows;
use super::spec::RunSpec;
use super::table::{self, SceneTable, Spread, TableRow};
use crate::escape::one_line;
use crate::mhp::Precision;
use crate::people::CLASSES;
use crate::study::shard::Subset;
use std::fmt::Write as _;

/// The text of a row's cell; `None` where nothing is known.
type Cell<'a> = Box<dyn Fn(&TableRow) -> Option<String> + 'a>;

/// A column: its head, its cell, and whether it stands at the left.
struct Column<'a> {
    head: String,
    cell: Cell<'a>,
    /// Left out where no row has a value.
    optional: bool,
}

/// Head, table, notes. Nothing in it depends on the time or the machine.
pub(super) fn text(spec: &RunSpec, rows: &[TableRow], scenes: &[SceneTable]) -> String {
    let data = &spec.data;
    let mut text = format!("# {}\n\n", spec.study.title());
    let plural = if data.frames == 1 { "" } else { "s" };
    let subset = if data.subset == Subset::Hard { format!(" hard frame{plural}") } else { format!(" frame{plural}") };
    let precision = if spec.precision == Precision::F32 { "f32" } else { "f64" };
    let _ = writeln!(
        text,
        "{} of {}: {}{subset} of {}. Based on `{}`, {precision}, seed {}, mhp-inspector {}.{}\n",
        spec.study,
        escaped(&data.name),
        data.frames,
        data.asked(),
        escaped(&spec.base),
        spec.seed,
        spec.version,
        spec.shard.map(|shard| format!(" Shard {shard}: not the whole.")).unwrap_or_default(),
    );
    text += &(grid(&columns(spec, rows), rows) + &notes(spec, rows));
    for SceneTable { scene, rows } in scenes {
        let _ = write!(text, "\n## Scene {}\n\n{}", escaped(scene), grid(&columns(spec, rows), rows));
    }
    text
}

fn columns<'a>(spec: &'a RunSpec, rows: &[TableRow]) -> Vec<Column<'a>> {
    let mut columns: Vec<Column<'a>> = Vec::new();
    for (k, head) in spec.columns.iter().enumerate() {
        let cell = move |row: &TableRow| row.labels.get(k).map(|label| escaped(label));
        columns.push(Column { head: escaped(head), cell: Box::new(cell), optional: false });
    }
    let of_truth = spec.study == StudyKind::Truth;
    let mut add = |head: &str, optional: bool, cell: Cell<'a>| {
        columns.push(Column { head: head.to_owned(), cell, optional });
    };
    let some = |count: usize| (count > 0).then(|| count.to_string());
    let any = |get: fn(&TableRow) -> usize| rows.iter().any(|row| get(row) > 0);
    add("frames", false, Box::new(|row| Some(row.frames.to_string())));
    if any(|row| row.failed) {
        add("failed", true, Box::new(move |row| some(row.failed).or(Some("0".into()))));
    }
    if any(|row| row.count_mismatched) {
        add("count mismatch", true, Box::new(move |row| some(row.count_mismatched).or(Some("0".into()))));
    }
    if spec.study == StudyKind::Counting {
        for people in 0..CLASSES {
            let more = if people + 1 == CLASSES { " and more" } else { "" };
            let cell = move |row: &TableRow| percent(row.counts?.by_people[people]);
            add(&format!("{people}{more} right"), true, Box::new(cell));
        }
        add("weighted 91/8/1", false, Box::new(|row| percent2(row.counts?.weighted)));
        add("exact", false, Box::new(|row| percent2(row.counts?.overall)));
        add("within one", false, Box::new(|row| percent2(row.counts?.within_one)));
        add("paper weighted", true, Box::new(|row| percent(row.paper?.count_accuracy)));
        columns.retain(|column| !column.optional || rows.iter().any(|row| (column.cell)(row).is_some()));
        return columns;
    }
    add("held at the start", true, Box::new(|row| percent(row.held_share)));
    add("MAJPE, mm", false, Box::new(|row| spread(row.majpe_mm, 1)));
    add("median, mm", true, Box::new(|row| row.median_majpe_mm.map(|x| format!("{x:.1}"))));
    add("PA-MAJPE, mm", false, Box::new(|row| spread(row.pa_majpe_mm, 1)));
    add("OSPA, mm", true, Box::new(|row| spread(row.ospa_mm, 1)));
    add("start MAJPE, mm", true, Box::new(|row| spread(row.init_majpe_mm, 1)));
    add("start PA-MAJPE, mm", true, Box::new(|row| spread(row.init_pa_majpe_mm, 1)));
    add("better than start", true, Box::new(|row| percent(row.share_improved)));
    add("loss", true, Box::new(move |row| spread(row.loss.filter(|_| of_truth), 4)));
    add("loss below truth's", true, Box::new(|row| percent(row.share_below_truth)));
    add("by over 3 %", true, Box::new(|row| percent(row.share_clearly_below_truth)));
    add("IoU", false, Box::new(|row| spread(row.iou, 3)));
    add("converged", false, Box::new(|row| percent(row.converged_share)));
    add("reprojection, px", true, Box::new(|row| spread(row.reprojection_px, 1)));
    add("in image boxes", true, Box::new(|row| percent(row.box_coverage.map(|share| share.mean))));
    add("in map boxes", true, Box::new(|row| percent(row.map_box_coverage.map(|share| share.mean))));
    add("paper MAJPE", true, Box::new(|row| row.paper?.majpe_mm.map(|x| format!("{x:.1}"))));
    add("paper PA-MAJPE", true, Box::new(|row| row.paper?.pa_majpe_mm.map(|x| format!("{x:.1}"))));
    add("paper IoU", true, Box::new(|row| row.paper?.iou.map(|x| format!("{x:.2}"))));
    add("paper converged", true, Box::new(|row| percent(row.paper?.converged_share)));
    let remarks: Vec<String> = table::notes(rows).into_iter().map(str::to_owned).collect();
    let mark = move |row: &TableRow| table::mark(&remarks.iter().map(String::as_str).collect::<Vec<_>>(), row);
    add("note", true, Box::new(mark));
    columns.retain(|column| !column.optional || rows.iter().any(|row| (column.cell)(row).is_some()));
    columns
}

fn grid(columns: &[Column<'_>], rows: &[TableRow]) -> String {
    let heads = columns.iter().map(|column| column.head.clone()).collect::<Vec<_>>();
    let cells = |row: &TableRow| -> Vec<String> {
        columns.iter().map(|column| (column.cell)(row).unwrap_or_else(|| "–".into())).collect()
    };
    let body: Vec<Vec<String>> = rows.iter().map(cells).collect();
    let widths: Vec<usize> = (0..heads.len())
        .map(|k| body.iter().chain([&heads]).map(|line| line[k].chars().count()).max().unwrap_or(0))
        .collect();
    let labels = columns.iter().take_while(|column| !column.optional && column.head != "frames").count();
    let line = |cells: &[String]| {
        let padded =
            cells.iter().zip(&widths).enumerate().map(|(k, (cell, &width))| {
                if k < labels { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
        format!("| {} |\n", padded.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().enumerate().map(|(k, &width)| {
        if k < labels { "-".repeat(width.max(3)) } else { format!("{}:", "-".repeat(width.max(3) - 1)) }
    });
    let rule = format!("| {} |\n", rule.collect::<Vec<_>>().join(" | "));
    line(&heads) + &rule + &body.iter().map(|cells| line(cells)).collect::<String>()
}

fn notes(spec: &RunSpec, rows: &[TableRow]) -> String {
    if spec.study == StudyKind::Counting {
        let paper = spec.paper().map(|paper| format!("The paper's figures: {paper}.")).or_else(|| spec.paper_missing());
        return format!(
            "\nShares of frames whose number of people is the annotated one. {}\n",
            paper.unwrap_or_default()
        );
    }
    let mut notes = vec!["Means over the frames that were fitted with the annotated number of persons.".to_owned()];
    if rows.iter().any(|row| row.reprojection_px.is_some() || row.box_coverage.is_some()) {
        notes.push("Image labels: pixels under an uncertain camera calibration, no joint error.".into());
    }
    if let Some(paper) = spec.paper() {
        notes.push(format!(
            "The paper's figures: {paper}. Its errors are of a network that reads PPPR, ours of the fit itself: compare \
             trends, not sizes."
        ));
    }
    notes.extend(spec.paper_missing());
    let remarks = table::notes(rows);
    let remarks = remarks.iter().enumerate().map(|(k, note)| format!("\n[{}] {}.\n", k + 1, escaped(note)));
    format!("\n{}\n{}", notes.join(" "), remarks.collect::<Vec<_>>().concat())
}

/// Times by variant: a table of its own, because no two runs have the same.
pub(super) fn timing(spec: &RunSpec, rows: &Rows) -> String {
    if spec.study == StudyKind::Counting {
        return counting_speed(spec, rows);
    }
    let mut text =
        "| variant | frames | start, ms | fit, ms | one step, ms |\n| --- | --: | --: | --: | --: |\n".to_owned();
    for (k, variant) in spec.variants.iter().enumerate() {
        let of = || rows.values().filter(move |row| row.variant == k && !row.passing);
        let mean = |values: Vec<f64>| (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64);
        let told = |x: Option<f64>, digits: usize| x.map_or_else(|| "–".into(), |x| format!("{x:.digits$}"));
        let init = mean(of().filter_map(|row| row.init_ms).collect());
        let fit = mean(of().filter_map(|row| row.fit_ms).collect());
        let step =
            mean(of().filter_map(|row| Some(row.fit_ms? / row.fit.as_ref().ok()?.iterations.max(1) as f64)).collect());
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            escaped(&variant.name()),
            of().count(),
            told(init, 1),
            told(fit, 1),
            told(step, 2)
        );
    }
    text
}

/// How fast one thread counts, reading left out.
fn counting_speed(spec: &RunSpec, rows: &Rows) -> String {
    let views = spec.data.arrays.len();
    let mut text = "| variant | frames | count, ms | frames/s | maps/s |\n| --- | --: | --: | --: | --: |\n".to_owned();
    for (k, variant) in spec.variants.iter().enumerate() {
        let times: Vec<f64> = rows.values().filter(|row| row.variant == k).filter_map(|row| row.fit_ms).collect();
        let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
        let a_second = 1000.0 / mean.max(1e-9);
        let cells = format!("{} | {mean:.3} | {a_second:.0} | {:.0}", times.len(), a_second * views as f64);
        let _ = writeln!(text, "| {} | {cells} |", escaped(&variant.name()));
    }
    text
}

fn spread(value: Option<Spread>, digits: usize) -> Option<String> {
    value.map(|value| format!("{:.digits$}", value.mean))
}

fn percent2(share: Option<f64>) -> Option<String> {
    share.map(|share| format!("{:.2} %", 100.0 * share))
}

fn percent(share: Option<f64>) -> Option<String> {
    share.map(|share| format!("{:.1} %", 100.0 * share))
}

fn escaped(text: &str) -> String {
    one_line(&text.replace('|', "\\|").replace('\n', " ")).into_owned()
}
