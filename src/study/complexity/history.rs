//! The last T frames of a sequence, of which only the masks of strong bins are kept, a bit a cell.

use super::map::{Grid, MapNumbers, measure};
use super::{ComplexityOptions, Statistics};
use crate::dataset::Heatmap;
use crate::mhp::fill_missing;

/// Statistics of consecutive frames of one sequence, fed one after the other.
#[derive(Debug)]
pub(super) struct MaskHistory {
    options: ComplexityOptions,
    views: Vec<ViewHistory>,
    /// Readable frames in a row, up to now.
    run: usize,
    /// The slot that the next frame's masks go to.
    slot: usize,
    scratch: Vec<i64>,
}

/// The masks of one view: T of them, flat, a ring.
#[derive(Debug)]
struct ViewHistory {
    array: String,
    shape: Vec<usize>,
    grid: Grid,
    masks: Vec<u64>,
}

impl MaskHistory {
    /// Nothing seen yet of a sequence whose views have these arrays and bins.
    pub(super) fn new(views: impl Iterator<Item = (String, Vec<usize>)>, options: ComplexityOptions) -> Self {
        let views = views.map(|(array, shape)| {
            let grid = Grid::new(&shape);
            ViewHistory { array, shape, grid, masks: vec![0; grid.words() * options.window] }
        });
        Self { options, views: views.collect(), run: 0, slot: 0, scratch: Vec::new() }
    }

    /// Forgets what came before: another sequence begins, or a frame is missing.
    pub(super) fn forget(&mut self) {
        self.run = 0;
    }

    /// The next frame of the sequence, one map a view; its missing cells are filled in place.
    ///
    /// # Errors
    /// Names the array without a finite cell. The frame then counts as missing.
    pub(super) fn push(&mut self, maps: &mut [Heatmap]) -> Result<Statistics, String> {
        for (map, view) in maps.iter_mut().zip(&self.views) {
            if fill_missing(&mut map.data, &view.shape).is_none() {
                self.run = 0;
                return Err(format!("array `{}` has no finite cell", view.array));
            }
        }
        let window = self.options.window;
        self.run = (self.run + 1).min(window);
        let full = self.run == window;
        let (mut peaks, mut statics, mut saliencies) = (Mean::default(), Mean::default(), Mean::default());
        for (map, view) in maps.iter().zip(&mut self.views) {
            let numbers = view.push(&map.data, self.slot, &self.options, &mut self.scratch);
            peaks.add(Some(numbers.peak_density));
            saliencies.add(numbers.human_saliency);
            statics.add(view.static_share(self.slot).filter(|_| full));
        }
        self.slot = (self.slot + 1) % window;
        Ok(Statistics {
            peak_density: peaks.value(),
            static_dominance: statics.value(),
            human_saliency: saliencies.value(),
        })
    }
}

impl ViewHistory {
    fn push(&mut self, map: &[f64], slot: usize, options: &ComplexityOptions, scratch: &mut Vec<i64>) -> MapNumbers {
        let words = self.grid.words();
        let strong = self.masks.get_mut(slot * words..(slot + 1) * words).unwrap_or_default();
        measure(map, &self.grid, options, strong, scratch)
    }

    /// The share of the strong bins of `slot` that are strong in every slot; `None` where there is none.
    fn static_share(&self, slot: usize) -> Option<f64> {
        let words = self.grid.words();
        let (mut strong, mut always) = (0, 0);
        for word in 0..words {
            let bits_of = |slot: usize| self.masks.get(slot * words + word).copied().unwrap_or(0);
            let slots = self.masks.len() / words;
            strong += bits_of(slot).count_ones();
            always += (0..slots).fold(u64::MAX, |all, slot| all & bits_of(slot)).count_ones();
        }
        (strong > 0).then(|| f64::from(always) / f64::from(strong))
    }
}

/// The mean over the views where there is a number.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, x: Option<f64>) {
        if let Some(x) = x {
            self.sum += x;
            self.count += 1;
        }
    }

    fn value(self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}
