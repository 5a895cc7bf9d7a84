//! Where the maps are: a row a view, a column a content, what belongs to a whole row beside it.
//!
//! ```text
//!  y axis │ H_ori │ H_sim │ masks │ overview, colour bar      one view
//!         └ x ──────────────────────┘
//!  y axis │ H_ori │ H_sim │ masks │ overview, colour bar      the next
//!         └ x ──────────────────────┘
//!  what is under the pointer
//! ```

use egui::{Rect, pos2, vec2};

/// Columns of a row, in order.
pub(super) const COLUMNS: usize = 3;

/// The numbers and the name of the vertical axis, points.
const LEFT: f32 = 42.0;
/// Overview and colour bar.
const RIGHT: f32 = 72.0;
/// The numbers of the horizontal axis.
const BELOW: f32 = 15.0;
/// Between maps.
const GAP: f32 = 5.0;
/// What is said of the cell under the pointer.
pub(super) const READOUT: f32 = 36.0;
/// What is said of the nine cells round it.
pub(super) const NEIGHBOURS: f32 = 46.0;
/// A map that is smaller has neither axes nor colour bar.
const LEAST: [f32; 2] = [70.0, 56.0];

/// One view's maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GridRow {
    /// The view.
    pub(super) view: usize,
    /// Its maps; those that are not drawn are empty.
    pub(super) maps: [Rect; COLUMNS],
    /// Room for overview and colour bar; empty where there is none.
    pub(super) beside: Rect,
    /// Whether there is room for axes.
    pub(super) axes: bool,
}

/// Rows for `views` maps in `area`; one map alone where `solo` names it by view and column.
pub(super) fn rows(area: Rect, views: usize, solo: Option<(usize, usize)>) -> Vec<GridRow> {
    let shown: Vec<usize> = solo.map_or_else(|| (0..views).collect(), |(view, _)| vec![view]);
    let columns = if solo.is_some() { 1 } else { COLUMNS };
    let height = area.height() / shown.len().max(1) as f32;
    let size = |left: f32, right: f32, below: f32| {
        let gaps = GAP * (columns - 1) as f32;
        vec2((area.width() - left - right - gaps) / columns as f32, height - below - GAP)
    };
    let with_axes = size(LEFT, RIGHT, BELOW);
    let axes = with_axes.x >= LEAST[0] && with_axes.y >= LEAST[1];
    let (left, map) = if axes { (LEFT, with_axes) } else { (GAP, size(GAP, GAP, 0.0)) };
    let map = map.max(vec2(1.0, 1.0));
    let row = |(k, view): (usize, usize)| {
        let top = area.min.y + height * k as f32 + GAP * 0.5;
        let at = |column: usize| {
            let x = area.min.x + left + (map.x + GAP) * column as f32;
            Rect::from_min_size(pos2(x, top), map)
        };
        let maps = std::array::from_fn(|column| match solo {
            None => at(column),
            Some((_, only)) if only == column => at(0),
            Some(_) => Rect::NOTHING,
        });
        let last = at(columns - 1);
        let beside = Rect::from_min_max(pos2(last.max.x + 3.0, top), pos2(area.max.x, last.max.y));
        GridRow { view, maps, beside: if axes { beside } else { Rect::NOTHING }, axes }
    };
    shown.into_iter().enumerate().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_share_the_area_and_do_not_overlap() {
        let area = Rect::from_min_size(pos2(10.0, 20.0), vec2(800.0, 500.0));
        for views in 1..=4 {
            let rows = rows(area, views, None);
            assert_eq!(rows.len(), views);
            let maps: Vec<Rect> = rows.iter().flat_map(|row| row.maps).collect();
            for (k, map) in maps.iter().enumerate() {
                assert!(area.contains_rect(*map) && (map.size() - maps[0].size()).length() < 0.01, "{map}");
                assert!(maps[..k].iter().all(|other| !other.shrink(0.1).intersects(*map)), "{views} views: {map}");
            }
            for row in &rows {
                assert!(row.axes && area.contains_rect(row.beside) && !row.beside.intersects(row.maps[2]));
            }
        }
    }

    #[test]
    fn one_map_alone_takes_the_area_of_all() {
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(800.0, 500.0));
        let [row] = rows(area, 2, Some((1, 2)))[..] else { unreachable!("one row") };
        assert_eq!((row.view, row.maps[0], row.maps[1]), (1, Rect::NOTHING, Rect::NOTHING));
        assert!(row.maps[2].area() > 0.8 * area.area(), "{}", row.maps[2]);
    }

    #[test]
    fn where_there_is_hardly_room_the_maps_have_it() {
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(200.0, 100.0));
        let rows = rows(area, 2, None);
        assert!(!rows[0].axes && rows[0].maps[0].width() > 55.0, "{:?}", rows[0]);
    }
}
