#![doc = include_str!("deviations.md")]

#[cfg(test)]
mod tests {
    use crate::config::{Field, FitConfig, Preset};

    /// The page's table of switches has a row for each setting of `paper` that is not the default, and both values in it.
    #[test]
    fn the_page_lists_what_paper_sets_otherwise() {
        let page = include_str!("deviations.md");
        let rows = page.lines().skip_while(|line| !line.starts_with("## Switches")).skip(1);
        let rows = rows.skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2);
        let rows: Vec<Vec<&str>> = rows.map(|row| row.split(" | ").collect()).collect();
        let key = |row: &[&str]| row[0].trim_start_matches("| ").trim_matches('`').to_owned();
        let (plain, paper) = (FitConfig::default(), Preset::Paper.config());
        let mut told: Vec<String> = rows.iter().map(|row| key(row)).collect();
        let mut changed: Vec<&str> = plain.changes(&paper).map(|field| field.key).collect();
        told.sort();
        changed.sort_unstable();
        assert_eq!(told, changed);
        for row in &rows {
            let field = Field::of_key(&key(row));
            let text = |config: &FitConfig| field.map_or_else(String::new, |field| field.text(field.get(config)));
            assert!(row[2].contains(&text(&plain)), "{}: {} in {:?}", key(row), text(&plain), row[2]);
            assert!(row[3].contains(&text(&paper)), "{}: {} in {:?}", key(row), text(&paper), row[3]);
        }
    }
}
