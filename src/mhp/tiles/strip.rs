//! A joint in sixteen tiles beside each other.

use super::{ACROSS, ALONG, CELLS, FAINTEST, Joint, Lanes, STRONGEST, Simd, lanes, splat};

/// A joint in those of a block's tiles that it matters to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Strip {
    pub block: u32,
    pub slice: u32,
    pub row: u32,
    /// First of the block's tiles in the row.
    pub column: u32,
    /// A bit a tile that the joint matters to.
    pub tiles: u32,
    /// Middle of the row minus joint, bins.
    pub across: f32,
    /// Middle minus joint along the row, bins, a tile.
    pub along: [f32; CELLS],
    /// log₂ in a tile's middle relative to the view's scale, and its slopes across and along.
    pub exponent: [f32; CELLS],
    pub slope: [[f32; CELLS]; 2],
    /// e^{i…} in the middle.
    pub turn: [[f32; CELLS]; 2],
}

/// The places of a number's bits, from the lowest on.
pub(super) fn bits(mut of: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (of != 0).then(|| of.trailing_zeros() as usize)?;
        of &= of - 1;
        Some(place)
    })
}

impl Strip {
    /// A K of some cells of tile `tile` (of sixteen), and its real and imaginary part (nothing where the sum is incoherent).
    #[inline(always)]
    pub(super) fn at<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        joint: &Joint,
        tile: usize,
        part: usize,
    ) -> [Lanes<S>; 3] {
        let [across, along] = [self.slope[0][tile], self.slope[1][tile]];
        let bent = lanes(simd, &joint.quadratic, part) + splat(simd, self.exponent[tile]);
        let mut exponent = lanes(simd, &ALONG, part).mul_add(splat(simd, along), bent);
        exponent = lanes(simd, &ACROSS, part).mul_add(splat(simd, across), exponent);
        if let Some(spectrum) = joint.along.cells.get(self.column as usize + tile) {
            exponent += lanes(simd, spectrum, part);
        }
        if let Some(spectrum) = joint.across.cells.get(self.row as usize) {
            exponent += lanes(simd, spectrum, part);
        }
        let a = exponent.max(splat(simd, FAINTEST)).min(splat(simd, STRONGEST)).exp2();
        if !COHERENT {
            return [a, splat(simd, 0.0), splat(simd, 0.0)];
        }
        let (c, s) = (splat(simd, self.turn[0][tile]), splat(simd, self.turn[1][tile]));
        let (re, im) = (lanes(simd, &joint.turn[0], part), lanes(simd, &joint.turn[1], part));
        [a, a * (c * re - s * im), a * c.mul_add(im, s * re)]
    }
}
