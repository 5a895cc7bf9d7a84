//! Networks that read fits beside those that read maps: the paper's A.6, and the same without its pooling.

use super::bed::{Bed, row, table};

/// What is learned from, and what is asked: no sequence of the one is in the other.
const LESSONS: &str = "--preset easy,medium,hard --frames 2400 --sequence-length 12 --people 1 --seed 2301";
const UNSEEN: &str = "--preset easy,medium,hard --frames 600 --people 1 --seed 600";
/// Other radars than the one that is learned from, and unseen people before them.
const OTHERS: [(&str, &str); 3] = [
    ("generic", "--layout generic --preset easy,medium,hard --frames 120 --people 1 --seed 811"),
    ("hupr", "--layout hupr --preset easy,medium,hard --frames 40 --people 1 --seed 812 --narrow"),
    ("xrf55", "--layout xrf55 --preset easy,medium,hard --frames 120 --people 1 --seed 813"),
];
/// A scene that is learned, and three others of the same radar.
const SCENES: [(&str, &str); 4] = [
    ("scene-1", "--preset medium --frames 900 --sequence-length 12 --people 1 --seed 2401 --room-seed 1"),
    ("scene-2", "--preset medium --frames 120 --sequence-length 12 --people 1 --seed 2402 --room-seed 2"),
    ("scene-3", "--preset medium --frames 120 --sequence-length 12 --people 1 --seed 2403 --room-seed 3"),
    ("scene-4", "--preset medium --frames 120 --sequence-length 12 --people 1 --seed 2404 --room-seed 4"),
];
/// Name, features and architecture.
const NETWORKS: [(&str, &str, &str); 4] = [
    ("MLP+PPPR (A.6, pooled)", "pppr", "mlp"),
    ("without the pooling", "pppr", "mlp-joints"),
    ("without it, joints alone", "fit-joints", "mlp-joints"),
    ("the same network on heatmaps", "heatmap", "mlp"),
];

pub(crate) fn section(bed: &Bed) -> String {
    let data = [("lessons", LESSONS), ("unseen", UNSEEN)].into_iter().chain(OTHERS).chain(SCENES);
    let mut errors: Vec<Vec<String>> = vec![Vec::new(); 2];
    for (name, options) in data {
        bed.simulated(name, options);
        bed.program(&["fit", name, "--out", &format!("{name}-fits")]);
        if name != "lessons" && !name.starts_with("scene") {
            for (row, column) in
                errors.iter_mut().zip([["init_majpe_mm", "init_pa_majpe_mm"], ["majpe_mm", "pa_majpe_mm"]])
            {
                row.push(told(bed, name, column));
            }
        }
    }
    let heads = ["mm", "unseen", "generic", "hupr", "xrf55", "parameters", "MB", "ms a frame", "FPS"];
    let mut rows = vec![row(&heads)];
    for (name, cells) in ["start", "fit"].into_iter().zip(errors) {
        rows.push([vec![name.to_owned()], cells, row(&["–", "–", "–", "–"])].concat());
    }
    for (k, (name, features, model)) in NETWORKS.into_iter().enumerate() {
        let out = format!("network-{k}");
        let trained = bed.tried(&[
            "train-pose",
            "lessons",
            "--params",
            "lessons-fits",
            "--features",
            features,
            "--model",
            model,
            "--out",
            &out,
        ]);
        if let Err(why) = trained {
            let why = why.lines().find(|line| line.starts_with("error")).unwrap_or_default();
            return format!(
                "Not measured: {why}\n\nIt needs a program that was built with `--features train` (`MHP_PROGRAM`)."
            );
        }
        let mut cells = vec![name.to_owned()];
        let mut size = row(&["–", "–", "–", "–"]);
        for set in ["unseen"].into_iter().chain(OTHERS.map(|(name, _)| name)) {
            let (file, fits) = (format!("{out}-{set}.npz"), format!("{set}-fits"));
            let model = format!("{out}/model.safetensors");
            match bed.tried(&["predict", set, "--model", &model, "--params", &fits, "--out", &file]) {
                Ok(said) => {
                    let number = |before: &str, after: &str| -> String {
                        let found = said.split(after).next().and_then(|text| text.rsplit(before).next());
                        found.unwrap_or("–").trim().to_owned()
                    };
                    cells.push(format!("{} / {}", number("\nMAJPE ", " mm, PA"), number("PA-MAJPE ", " mm over")));
                    if set == "unseen" {
                        let ms = number("; ", " ms a frame");
                        let fps = ms.parse().map_or("–".to_owned(), |ms: f64| format!("{:.0}", 1e3 / ms));
                        size = vec![number(", ", " parameters"), number(", ", " MB;"), ms, fps];
                    }
                }
                Err(_) => cells.push("–".to_owned()),
            }
        }
        rows.push([cells, size].concat());
    }
    let across = |study: &str, sets: &[&str]| {
        let fits: Vec<String> = sets.iter().map(|set| format!("{set}-fits")).collect();
        let mut words = vec!["study", study];
        words.extend(sets);
        words.extend(fits.iter().flat_map(|fits| ["--params", fits.as_str()]));
        words.extend(["--out", study]);
        let said = bed.program(&words);
        said.split_once("\n\n").map_or(said.clone(), |(_, rest)| rest.trim().to_owned())
    };
    let scenes = across("cross-scene", &SCENES.map(|(name, _)| name));
    let radars = across("cross-dataset", &["lessons", "generic", "hupr", "xrf55"]);
    let told: Vec<String> = SCENES.iter().map(|(name, options)| format!("{name}: `simulate {options}`")).collect();
    format!(
        "`train-pose DATA --params FITS --features F --model M` on `simulate {LESSONS}` and its fits, with the paper's schedule; then `predict` on `simulate {UNSEEN}` \
         (unseen) and before other radars ({}). MAJPE / PA-MAJPE over all frames; – where a network cannot read such data. Latency is the network's alone, after the fit.\n\n{}\n\n\
         ### Across scenes\n\n`study cross-scene` on {}, and their fits.\n\n{scenes}\n\n\
         ### Across radars\n\n`study cross-dataset` on the data above and their fits: one layout a radar, by calibration alone.\n\n{radars}",
        OTHERS.map(|(name, options)| format!("{name}: `{options}`")).join("; "),
        table(&rows),
        told.join("; "),
    )
}

/// Mean errors of the fits of a data set, of frames with as many people as annotated.
fn told(bed: &Bed, name: &str, columns: [&str; 2]) -> String {
    let run = format!("{name}-study");
    if !bed.path(&run).exists() {
        bed.study("complexity", &bed.path(name), &run, &["--preset", "recommended"]);
    }
    let mut reader = csv::Reader::from_path(bed.path(&run).join("rows.csv")).unwrap();
    let rows: Vec<std::collections::BTreeMap<String, String>> = reader.deserialize().map(|row| row.unwrap()).collect();
    let mean = |column: &str| {
        let all: Vec<f64> = rows
            .iter()
            .filter(|row| row["count_matched"] == "true")
            .filter_map(|row| row[column].parse().ok())
            .collect();
        if all.is_empty() { "–".to_owned() } else { format!("{:.1}", all.iter().sum::<f64>() / all.len() as f64) }
    };
    columns.map(mean).join(" / ")
}
