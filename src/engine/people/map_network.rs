//! Another comparison: a convolutional network that looks at the maps themselves, without detection, clusters or earlier frames.
//!
//! Each of the first two maps is brought to 64 × 32 cells; three layers of 3 × 3 filters, each followed by ReLU and the largest of
//! 2 × 2, and one dense layer. What it reaches beside the counter shows what a network learns of maps that a counter is told.

use super::error::PeopleError;
use super::network::{CLASSES, Layer, softmax};
use crate::radar::coarse;
use serde::{Deserialize, Serialize};

/// Rows and columns that a map is brought to.
pub const IMAGE: [usize; 2] = [64, 32];
/// Maps that are looked at, and what each of the three layers of filters makes of them.
pub const CHANNELS: [usize; 4] = [2, 8, 16, 32];
/// Cells a side of a filter.
pub(super) const FILTER: usize = 3;

/// A layer of 3 × 3 filters, zeros around the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FilterLayer {
    /// (outputs, inputs · 9): the filters in C order.
    pub weight: Vec<Vec<f32>>,
    /// One an output.
    pub bias: Vec<f32>,
}

/// The network, read from its committed weights; f32.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapNetwork {
    /// How it came about: the command, the seeds and what was measured.
    pub header: Vec<String>,
    /// The layers of filters.
    pub filters: Vec<FilterLayer>,
    /// From what is left of the image to the classes.
    pub dense: Layer,
}

/// Numbers that the dense layer reads.
pub(super) fn dense_inputs() -> usize {
    let halvings = CHANNELS.len() - 1;
    CHANNELS[halvings] * (IMAGE[0] >> halvings) * (IMAGE[1] >> halvings)
}

/// What the network reads: (2, 64, 32), the first two maps (zeros where one is not there). `shapes` are the sizes of their axes; the
/// last two are kept, those before them averaged over.
pub fn map_image(maps: &[(&[usize], &[f64])]) -> Vec<f32> {
    let cells = IMAGE[0] * IMAGE[1];
    let mut image = vec![0.0; CHANNELS[0] * cells];
    for ((shape, map), out) in maps.iter().zip(image.chunks_exact_mut(cells)) {
        standardised(&coarse(shape, map, IMAGE), out);
    }
    image
}

/// ln of the means, of mean 0 and standard deviation 1; 0 where there is nothing.
fn standardised(means: &[f64], out: &mut [f32]) {
    let ln: Vec<Option<f64>> = means.iter().map(|x| (*x > 0.0).then(|| x.ln())).collect();
    let n = ln.iter().flatten().count().max(1) as f64;
    let mean = ln.iter().flatten().sum::<f64>() / n;
    let deviation = (ln.iter().flatten().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt().max(1e-12);
    for (out, ln) in out.iter_mut().zip(ln) {
        *out = ln.map_or(0.0, |ln| ((ln - mean) / deviation) as f32);
    }
}

impl MapNetwork {
    /// The weights that come with the program.
    ///
    /// # Errors
    /// Where they are damaged.
    pub fn bundled() -> Result<Self, PeopleError> {
        Self::from_json(include_str!("../../../assets/counter-maps.json"))
    }

    /// Reads a network.
    ///
    /// # Errors
    /// Where the text is no such network of [`CHANNELS`] with finite weights.
    pub fn from_json(text: &str) -> Result<Self, PeopleError> {
        let network: Self =
            serde_json::from_str(text).map_err(|error| PeopleError::Weights { message: error.to_string() })?;
        let wrong = |message: String| Err(PeopleError::Weights { message });
        let sized = |weight: &[Vec<f32>], bias: &[f32], [from, to]: [usize; 2]| {
            weight.len() == to && bias.len() == to && weight.iter().all(|row| row.len() == from)
        };
        if network.filters.len() + 1 != CHANNELS.len() {
            return wrong(format!("expected {} layers of filters", CHANNELS.len() - 1));
        }
        for (layer, pair) in network.filters.iter().zip(CHANNELS.windows(2)) {
            let size = [pair[0] * FILTER * FILTER, pair[1]];
            if !sized(&layer.weight, &layer.bias, size) {
                return wrong(format!("expected {} filters of {} numbers", size[1], size[0]));
            }
        }
        if !sized(&network.dense.weight, &network.dense.bias, [dense_inputs(), CLASSES]) {
            return wrong(format!("expected a dense layer of {CLASSES} by {}", dense_inputs()));
        }
        let filters = network.filters.iter().map(|layer| (&layer.weight, &layer.bias));
        let layers = filters.chain([(&network.dense.weight, &network.dense.bias)]);
        let finite = layers.flat_map(|(weight, bias)| weight.iter().flatten().chain(bias)).all(|x| x.is_finite());
        if !finite {
            return wrong("a weight is not finite".into());
        }
        Ok(network)
    }

    /// Softmax probabilities of 0, 1, 2, 3, and 4 or more people, of what [`map_image`] makes of a frame.
    pub fn probabilities(&self, image: &[f32]) -> [f64; CLASSES] {
        let (mut x, mut size) = (image.to_vec(), IMAGE);
        for layer in &self.filters {
            x = halved(&layer.answer(&x, size), size);
            size = [size[0] / 2, size[1] / 2];
        }
        let dot = |row: &Vec<f32>| row.iter().zip(&x).map(|(w, x)| w * x).sum::<f32>();
        let logits: Vec<f32> =
            self.dense.weight.iter().zip(&self.dense.bias).map(|(row, bias)| dot(row) + bias).collect();
        softmax(&logits)
    }
}

impl FilterLayer {
    /// ReLU of the filters over an image of (inputs, height, width).
    fn answer(&self, image: &[f32], [height, width]: [usize; 2]) -> Vec<f32> {
        let cells = height * width;
        let mut answers = Vec::with_capacity(self.bias.len() * cells);
        for (filters, bias) in self.weight.iter().zip(&self.bias) {
            let mut sums = vec![*bias; cells];
            for (filter, plane) in filters.chunks_exact(FILTER * FILTER).zip(image.chunks_exact(cells)) {
                for (k, weight) in filter.iter().enumerate() {
                    let (down, right) = (k / FILTER, k % FILTER);
                    for (row, sums) in sums.chunks_exact_mut(width).enumerate() {
                        let Some(from) = (row + down).checked_sub(1).filter(|from| *from < height) else { continue };
                        let from = &plane[from * width..(from + 1) * width];
                        // The filter's column `right` lies one cell left of, at, or right of the sum.
                        let (sums, from) = match right {
                            0 => (&mut sums[1..], &from[..width - 1]),
                            1 => (&mut *sums, from),
                            _ => (&mut sums[..width - 1], &from[1..]),
                        };
                        sums.iter_mut().zip(from).for_each(|(sum, x)| *sum += weight * x);
                    }
                }
            }
            answers.extend(sums.into_iter().map(|x| x.max(0.0)));
        }
        answers
    }
}

/// The largest of each 2 × 2 cells of every plane.
fn halved(planes: &[f32], [height, width]: [usize; 2]) -> Vec<f32> {
    let of_plane = |plane: &[f32]| -> Vec<f32> {
        (0..height / 2 * (width / 2))
            .map(|k| {
                let first = 2 * (k / (width / 2)) * width + 2 * (k % (width / 2));
                [0, 1, width, width + 1].map(|next| plane[first + next]).into_iter().fold(f32::MIN, f32::max)
            })
            .collect()
    };
    planes.chunks_exact(height * width).flat_map(of_plane).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_looks_at_the_cells_around_and_at_zeros_beyond() {
        let mut filter = vec![0.0; 9];
        (filter[0], filter[5]) = (1.0, 10.0);
        let layer = FilterLayer { weight: vec![filter], bias: vec![0.5] };
        let answer = layer.answer(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [2, 3]);
        assert_eq!(answer, [20.5, 30.5, 0.5, 50.5, 61.5, 2.5], "above left once, right ten times");
        assert_eq!(halved(&[1.0, 2.0, 3.0, 4.0, 8.0, 6.0, 7.0, 5.0], [2, 4]), [8.0, 7.0]);
    }

    #[test]
    fn maps_of_any_size_make_an_image_of_mean_0() {
        for shape in [vec![256, 128], vec![16, 64, 64], vec![8, 8], vec![40]] {
            let cells: Vec<f64> = (0..shape.iter().product()).map(|k| 1.0 + (k % 7) as f64).collect();
            let image = map_image(&[(&shape, &cells)]);
            assert_eq!(image.len(), 2 * 64 * 32);
            let mean = image.iter().sum::<f32>();
            assert!(mean.abs() < 0.05 && image.iter().all(|x| x.is_finite()), "{shape:?} {mean}");
        }
        assert!(map_image(&[(&[4, 4], &[f64::NAN; 16])]).iter().all(|x| *x == 0.0));
    }

    #[test]
    fn the_bundled_weights_are_whole_and_damaged_ones_are_told() -> Result<(), PeopleError> {
        let network = MapNetwork::bundled()?;
        let sum: f64 = network.probabilities(&map_image(&[])).iter().sum();
        assert!((sum - 1.0).abs() < 1e-9);
        let mut damaged = network;
        damaged.filters[1].weight[3].pop();
        let text = serde_json::to_string(&damaged).unwrap_or_default();
        let told = MapNetwork::from_json(&text).map_err(|error| error.to_string());
        assert!(told.is_err_and(|told| told.contains("expected 16 filters of 72 numbers")));
        Ok(())
    }
}
