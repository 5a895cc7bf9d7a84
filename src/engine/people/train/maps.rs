//! The same for the convolutional network on the maps.

use super::{TrainOptions, descend, dropped, shared};
use crate::people::map_network::{CHANNELS, FILTER, FilterLayer, IMAGE, MapNetwork, dense_inputs};
use crate::people::network::{CLASSES, Layer};
use candle_core::{D, DType, Device, Result, Tensor, Var};
use rand::{Rng as _, SeedableRng as _, rngs::StdRng};
use rand_distr::StandardNormal;

/// The maps of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MapLesson {
    /// What [`crate::people::map_image`] makes of them.
    pub image: Vec<f32>,
    /// The same with left and right exchanged.
    pub mirrored: Vec<f32>,
    /// How many people there are.
    pub people: usize,
}

/// Trains a network on maps; every epoch sees each frame once, mirrored or not by chance. `told` hears epoch and mean loss.
///
/// # Errors
/// candle's, which would be a mistake in here.
pub fn train_on_maps(
    lessons: &[&MapLesson],
    options: &TrainOptions,
    told: impl FnMut(usize, f32),
) -> Result<MapNetwork> {
    let mut rng = StdRng::seed_from_u64(options.seed);
    let people: Vec<usize> = lessons.iter().map(|lesson| lesson.people).collect();
    let weights = shared(&people, options.weights);
    let options = TrainOptions { weights, ..*options };
    let model = Model::new(&mut rng)?;
    let loss = |chosen: &[usize], rng: &mut StdRng| {
        let batch: Vec<&MapLesson> = chosen.iter().filter_map(|&i| lessons.get(i).copied()).collect();
        model.loss(&batch, &options, rng)
    };
    descend((model.vars(), lessons.len()), &options, &mut rng, loss, told)?;
    model.network()
}

struct Model {
    /// Weight (9 · inputs, outputs) and bias of each layer of filters; row by row of a filter, the inputs innermost.
    filters: Vec<(Var, Var)>,
    /// Weight (classes, inputs) and bias.
    dense: (Var, Var),
}

impl Model {
    /// Weights uniform in ±√(6/inputs) (He), no bias.
    fn new(rng: &mut StdRng) -> Result<Self> {
        let mut layer = |outputs: usize, inputs: usize, shape: &[usize]| -> Result<(Var, Var)> {
            let bound = (6.0 / inputs as f32).sqrt();
            let weights: Vec<f32> = (0..inputs * outputs).map(|_| rng.random_range(-bound..bound)).collect();
            Ok((Var::from_vec(weights, shape, &Device::Cpu)?, Var::zeros(outputs, DType::F32, &Device::Cpu)?))
        };
        let filters = CHANNELS
            .windows(2)
            .map(|pair| layer(pair[1], pair[0] * FILTER * FILTER, &[pair[0] * FILTER * FILTER, pair[1]]))
            .collect::<Result<_>>()?;
        let inputs = dense_inputs();
        Ok(Self { filters, dense: layer(CLASSES, inputs, &[CLASSES, inputs])? })
    }

    fn vars(&self) -> Vec<Var> {
        let layers = self.filters.iter().chain([&self.dense]);
        layers.flat_map(|(weight, bias)| [weight.clone(), bias.clone()]).collect()
    }

    /// Cross-entropy of the counts of a batch.
    fn loss(&self, batch: &[&MapLesson], options: &TrainOptions, rng: &mut StdRng) -> Result<Tensor> {
        let n = batch.len();
        let (mut images, mut truth) = (Vec::new(), Vec::new());
        for lesson in batch {
            let image = if rng.random_bool(0.5) { &lesson.mirrored } else { &lesson.image };
            images.extend(image.iter().map(|x| x + options.noise as f32 * rng.sample::<f32, _>(StandardNormal)));
            let class = lesson.people.min(CLASSES - 1);
            truth.extend((0..CLASSES).map(|k| if k == class { options.weights[k] } else { 0.0 }));
        }
        let images = Tensor::from_vec(images, (n, CHANNELS[0], IMAGE[0], IMAGE[1]), &Device::Cpu)?;
        let mut x = images.permute((0, 2, 3, 1))?.contiguous()?;
        for (weight, bias) in &self.filters {
            x = halved(&filtered(&x, weight)?.broadcast_add(bias)?.relu()?)?;
        }
        x = x.permute((0, 3, 1, 2))?.contiguous()?.flatten_from(1)?;
        if options.dropout > 0.0 {
            let mask = dropped(x.elem_count(), options.dropout, rng);
            x = x.mul(&Tensor::from_vec(mask, x.shape().clone(), &Device::Cpu)?)?;
        }
        let (weight, bias) = &self.dense;
        let logits = x.matmul(&weight.t()?)?.broadcast_add(bias)?;
        let likelihood = candle_nn::ops::log_softmax(&logits, D::Minus1)?;
        let truth = Tensor::from_vec(truth, (n, CLASSES), &Device::Cpu)?;
        (truth.mul(&likelihood)?.sum_all()?.neg()? / n as f64)?.reshape(())
    }

    fn network(&self) -> Result<MapNetwork> {
        let of_filters = |(weight, bias): &(Var, Var)| -> Result<FilterLayer> {
            let (rows, outputs) = weight.dims2()?;
            let places = FILTER * FILTER;
            let by_input = weight.reshape((places, rows / places, outputs))?.permute((2, 1, 0))?.contiguous()?;
            Ok(FilterLayer { weight: by_input.reshape((outputs, rows))?.to_vec2()?, bias: bias.to_vec1()? })
        };
        let filters = self.filters.iter().map(of_filters).collect::<Result<_>>()?;
        let (weight, bias) = &self.dense;
        let dense = Layer { weight: weight.to_vec2()?, bias: bias.to_vec1()? };
        Ok(MapNetwork { header: Vec::new(), filters, dense })
    }
}

/// Images of (n, height, width, inputs) under filters of (9 · inputs, outputs), zeros around them. As one product: candle's own
/// convolution takes ten times as long to go back through.
fn filtered(images: &Tensor, filters: &Tensor) -> Result<Tensor> {
    let (n, height, width, inputs) = images.dims4()?;
    let around = FILTER / 2;
    let padded = images.pad_with_zeros(1, around, around)?.pad_with_zeros(2, around, around)?;
    let shifted = (0..FILTER * FILTER)
        .map(|k| padded.narrow(1, k / FILTER, height)?.narrow(2, k % FILTER, width))
        .collect::<Result<Vec<_>>>()?;
    let rows = Tensor::cat(&shifted, 3)?.reshape((n * height * width, FILTER * FILTER * inputs))?;
    rows.matmul(filters)?.reshape((n, height, width, ()))
}

/// The largest of each 2 × 2 cells.
fn halved(images: &Tensor) -> Result<Tensor> {
    let (n, height, width, channels) = images.dims4()?;
    images
        .reshape((n, height / 2, 2, width / 2, 2 * channels))?
        .max(2)?
        .reshape((n, height / 2, width / 2, 2, channels))?
        .max(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_trained_is_what_is_answered() -> Result<()> {
        let mut rng = StdRng::seed_from_u64(5);
        let model = Model::new(&mut rng)?;
        let image: Vec<f32> = (0..CHANNELS[0] * IMAGE[0] * IMAGE[1]).map(|_| rng.random_range(-2.0..2.0)).collect();
        let lesson = MapLesson { mirrored: image.clone(), image, people: 2 };
        let options = TrainOptions { noise: 0.0, dropout: 0.0, weights: [1.0; CLASSES], ..TrainOptions::default() };
        let loss = f64::from(model.loss(&[&lesson], &options, &mut rng)?.to_scalar::<f32>()?);
        let answered = model.network()?.probabilities(&lesson.image)[2];
        assert!((loss + answered.ln()).abs() < 1e-3 * loss.abs().max(1.0), "{loss} {answered}");
        Ok(())
    }
}
