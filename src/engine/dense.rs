//! A dense layer of a network: compiled here, where numbers are optimised in every profile.

/// bias + W x, W row by row: a row of `inputs` weights for each of `bias`.
pub fn dense(weight: &[f32], inputs: usize, bias: &[f32], x: &[f32]) -> Vec<f32> {
    weight.chunks_exact(inputs.max(1)).zip(bias).map(|(row, bias)| bias + product(row, x)).collect()
}

/// Sixteen sums side by side: the compiler makes a few instructions of them.
fn product(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 16];
    let (a16, a_rest) = a.as_chunks::<16>();
    let (b16, b_rest) = b.as_chunks::<16>();
    for (a, b) in a16.iter().zip(b16) {
        for k in 0..16 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    rest + sums.iter().sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_is_its_matrix_times_its_input() {
        let inputs = 37;
        let x: Vec<f32> = (0..inputs).map(|k| (k as f32 * 0.7).sin()).collect();
        let weight: Vec<f32> = (0..3 * inputs).map(|k| (k as f32 * 0.3).cos()).collect();
        let out = dense(&weight, inputs, &[1.0, -2.0, 0.5], &x);
        for (row, bias) in [1.0, -2.0, 0.5].into_iter().enumerate() {
            let plain: f64 = (0..inputs).map(|k| f64::from(weight[row * inputs + k]) * f64::from(x[k])).sum();
            assert!((f64::from(out[row]) - plain - bias).abs() < 1e-5, "{row}");
        }
    }
}
