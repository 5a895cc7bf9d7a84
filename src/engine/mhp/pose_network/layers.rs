//! The network: two towers of convolutions, one a plane, and dense layers over both.

use super::glimpse::{ACROSS, CHANNELS, RANGES, Seen, UP};
use crate::dense::dense;
use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2};
#[cfg(feature = "train")]
use safetensors::tensor::TensorView;
use safetensors::tensor::{Dtype, SafeTensors};
#[cfg(feature = "train")]
use std::collections::HashMap;

/// Channels of a tower, from its maps on, and the steps that each of its convolutions takes.
pub(super) const TOWER: [usize; 5] = [CHANNELS, 24, 48, 48, 32];
pub(super) const STRIDES: [usize; 4] = [2, 1, 2, 2];
/// Numbers of the hidden layers.
const HIDDEN: usize = 320;
/// Joints, and numbers of each: place, m, and ln of how far off it may be, m.
pub(super) const JOINTS: usize = 17;
pub(super) const OUT: usize = 4;
/// Bodies that it tells apart: one, and one that is turned about, are two; it ends in ln of how likely each is, but for what is the
/// same for all, and then in the joints of each.
pub(super) const BODIES: usize = 4;
/// Numbers that it ends in.
pub(super) const TOLD: usize = BODIES * (1 + JOINTS * OUT);

/// A layer: weights, the inputs of one output after the other, and what is added.
#[derive(Debug, Clone)]
struct Layer {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

/// Towers of convolutions of 3 × 3 cells, and dense layers, each with max(x, 0) behind it but the last.
#[derive(Debug, Clone)]
pub(super) struct Layers {
    towers: [Vec<Layer>; 2],
    dense: Vec<Layer>,
}

impl Layers {
    /// From all weights, one layer after the other in the order of [`shapes`]; `None` where there are more or fewer.
    pub(super) fn from_numbers(numbers: &[f32]) -> Option<Self> {
        let mut rest = numbers;
        let mut layer = |shape: &Shape| {
            let (weights, others) = rest.split_at_checked(shape.inputs * shape.outputs)?;
            let (bias, others) = others.split_at_checked(shape.outputs)?;
            rest = others;
            Some(Layer { weights: weights.to_vec(), bias: bias.to_vec() })
        };
        let mut all = shapes().iter().map(&mut layer).collect::<Option<Vec<Layer>>>()?;
        let dense = all.split_off(2 * STRIDES.len());
        let vertical = all.split_off(STRIDES.len());
        rest.is_empty().then_some(Self { towers: [all, vertical], dense })
    }

    /// From tensors of bfloat16, as [`Self::to_tensors`] writes them.
    ///
    /// # Errors
    /// Names the tensor that is missing, or has another type or size.
    pub(super) fn from_tensors(bytes: &[u8]) -> Result<Self, String> {
        let read = SafeTensors::deserialize(bytes).map_err(|error| error.to_string())?;
        let mut numbers = Vec::new();
        for (name, shape) in tensors() {
            let tensor = read.tensor(&name).map_err(|error| error.to_string())?;
            if tensor.dtype() != Dtype::BF16 || tensor.shape() != shape {
                return Err(format!("`{name}` is {:?} {:?}; expected BF16 {shape:?}", tensor.dtype(), tensor.shape()));
            }
            let halves = tensor.data().chunks_exact(2);
            numbers.extend(halves.map(|half| f32::from_bits(u32::from_le_bytes([0, 0, half[0], half[1]]))));
        }
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err("a weight is not finite".into());
        }
        Self::from_numbers(&numbers).ok_or_else(|| "expected other layers".into())
    }

    /// All weights, as [`Self::from_numbers`] reads them.
    #[cfg(feature = "train")]
    pub(super) fn numbers(&self) -> Vec<f32> {
        let layers = self.towers.iter().flatten().chain(&self.dense);
        layers.flat_map(|layer| [layer.weights.as_slice(), &layer.bias].concat()).collect()
    }

    /// As tensors of bfloat16, with what is told of them.
    ///
    /// # Errors
    /// Where they cannot be written, in words.
    #[cfg(feature = "train")]
    pub(super) fn to_tensors(&self, told: HashMap<String, String>) -> Result<Vec<u8>, String> {
        let layers = self.towers.iter().flatten().chain(&self.dense);
        let numbers = layers.flat_map(|layer| [&layer.weights, &layer.bias]);
        // To the nearest, ties to even.
        let half = |x: &f32| {
            let bits = x.to_bits();
            (((bits + 0x7FFF + (bits >> 16 & 1)) >> 16) as u16).to_le_bytes()
        };
        let halves: Vec<Vec<u8>> = numbers.map(|of| of.iter().flat_map(half).collect()).collect();
        let views = tensors().zip(&halves).map(|((name, shape), halves)| {
            let view = TensorView::new(Dtype::BF16, shape, halves).map_err(|error| error.to_string())?;
            Ok((name, view))
        });
        let views = views.collect::<Result<Vec<_>, String>>()?;
        safetensors::serialize(views, Some(told)).map_err(|error| error.to_string())
    }

    /// What it makes of what is seen: [`TOLD`] numbers.
    pub(super) fn run(&self, seen: &Seen) -> Vec<f32> {
        let mut x = tower(&self.towers[0], &seen.horizontal, ACROSS);
        x.extend(tower(&self.towers[1], &seen.vertical, UP));
        x.extend(seen.about);
        for (k, layer) in self.dense.iter().enumerate() {
            x = dense(&layer.weights, &layer.bias, &x);
            if k + 1 < self.dense.len() {
                rectify(&mut x);
            }
        }
        x
    }
}

/// A layer's name and size.
pub(super) struct Shape {
    name: String,
    /// Numbers that an output is made of: of a convolution nine a channel.
    pub(super) inputs: usize,
    pub(super) outputs: usize,
}

/// The layers: those of the horizontal tower, of the vertical one, and the dense ones.
pub(super) fn shapes() -> Vec<Shape> {
    let towers = ["horizontal", "vertical"].into_iter().flat_map(|tower| {
        let of = move |(k, pair): (usize, &[usize])| Shape {
            name: format!("{tower}.{k}"),
            inputs: 9 * pair[0],
            outputs: pair[1],
        };
        TOWER.windows(2).enumerate().map(of)
    });
    let dense = |(k, pair): (usize, &[usize])| Shape { name: format!("dense.{k}"), inputs: pair[0], outputs: pair[1] };
    towers.chain([flat(), HIDDEN, HIDDEN, TOLD].windows(2).enumerate().map(dense)).collect()
}

/// Names and shapes of all tensors, in the order of [`shapes`].
fn tensors() -> impl Iterator<Item = (String, Vec<usize>)> {
    shapes().into_iter().enumerate().flat_map(|(k, Shape { name, inputs, outputs })| {
        let convolves = k < 2 * STRIDES.len();
        let shape = if convolves { vec![outputs, inputs / 9, 3, 3] } else { vec![outputs, inputs] };
        [(format!("{name}.weight"), shape), (format!("{name}.bias"), vec![outputs])]
    })
}

/// Numbers that the towers end in, and what is said about the place.
pub(super) fn flat() -> usize {
    TOWER[TOWER.len() - 1] * (ends(ACROSS) + ends(UP)) + 3
}

/// Cells of a channel at a tower's end, of maps with so many columns.
fn ends(mut columns: usize) -> usize {
    let mut rows = RANGES;
    for stride in STRIDES {
        (rows, columns) = (rows.div_ceil(stride), columns.div_ceil(stride));
    }
    rows * columns
}

/// max(x, 0) of each.
pub(super) fn rectify(x: &mut [f32]) {
    for x in x {
        *x = x.max(0.0);
    }
}

/// The last channels of a tower, C order.
fn tower(layers: &[Layer], maps: &[f32], columns: usize) -> Vec<f32> {
    let (mut x, mut size) = (maps.to_vec(), [RANGES, columns]);
    for (layer, stride) in layers.iter().zip(STRIDES) {
        let (taps, after) = shifted(&x, size, stride);
        (x, size) = (convolved((&layer.weights, &layer.bias), &taps, after), after);
    }
    x
}

/// A convolution with 3 × 3 cells, beyond the edges of zeros, and max(x, 0): of what [`shifted`] makes of maps (outputs, cells), C order.
pub(super) fn convolved((weights, bias): (&[f32], &[f32]), shifted: &[f32], [rows, columns]: [usize; 2]) -> Vec<f32> {
    let cells = rows * columns;
    let mut out: Vec<f32> = bias.iter().flat_map(|&bias| std::iter::repeat_n(bias, cells)).collect();
    product(&mut out, [bias.len(), cells], (weights, false), (shifted, false), 1.0);
    rectify(&mut out);
    out
}

/// Of each weight of a convolution, at every so manyth cell of each axis, the cells that it is multiplied by, (channels · 9, cells),
/// and the rows and columns of what comes of it.
pub(super) fn shifted(x: &[f32], [rows, columns]: [usize; 2], stride: usize) -> (Vec<f32>, [usize; 2]) {
    let [high, wide] = [rows.div_ceil(stride), columns.div_ceil(stride)];
    let (cells, channels) = (high * wide, x.len() / (rows * columns));
    let mut shifted = vec![0.0_f32; channels * 9 * cells];
    for (tap, of_tap) in shifted.chunks_exact_mut(cells).enumerate() {
        let (channel, dy, dx) = (tap / 9, tap % 9 / 3, tap % 3);
        let map = &x[channel * rows * columns..(channel + 1) * rows * columns];
        for (i, of_row) in of_tap.chunks_exact_mut(wide).enumerate() {
            let Some(row) = (i * stride + dy).checked_sub(1).filter(|&row| row < rows) else { continue };
            let map = &map[row * columns..(row + 1) * columns];
            // The first tap of a row lies beyond its edge.
            let (to, from) = if dx == 0 { (1, stride - 1) } else { (0, dx - 1) };
            if let (Some(of_row), Some(map)) = (of_row.get_mut(to..), map.get(from..)) {
                match stride {
                    1 => of_row.iter_mut().zip(map).for_each(|(y, x)| *y = *x),
                    _ => of_row.iter_mut().zip(map.iter().step_by(stride)).for_each(|(y, x)| *y = *x),
                }
            }
        }
    }
    (shifted, [high, wide])
}

/// out ← out · `kept` + a · b, of this size, C order; each as it is or, where `true` is said, turned over.
pub(super) fn product(
    out: &mut [f32],
    [rows, columns]: [usize; 2],
    (a, a_turned): (&[f32], bool),
    (b, b_turned): (&[f32], bool),
    kept: f32,
) {
    let inner = a.len() / rows.max(1);
    let matrix = |of, size: [usize; 2], turned: bool| {
        let [rows, columns] = if turned { [size[1], size[0]] } else { size };
        let found = ArrayView2::from_shape((rows, columns), of).ok();
        found.map(|found| if turned { found.reversed_axes() } else { found })
    };
    let out = ArrayViewMut2::from_shape((rows, columns), out).ok();
    let found = (matrix(a, [rows, inner], a_turned), matrix(b, [inner, columns], b_turned), out);
    if let (Some(a), Some(b), Some(mut out)) = found {
        general_mat_mul(1.0, &a, &b, kept, &mut out);
    }
}
