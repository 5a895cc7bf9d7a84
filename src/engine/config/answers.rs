//! The answers to the choices of [`super::FIELDS`], the default first: the word of `FIT.toml`, the label on screen, what it means.

use super::Answer;

const fn answer(word: &'static str, label: &'static str, help: &'static str) -> Answer {
    Answer { word, label, help }
}

pub(super) const CONVERGENCE: &[Answer] = &[
    answer(
        "change",
        "little change",
        "L < 1, or |L₋₅ − L| < 0.5 % of L₋₅: a loss that still rises has not converged (SPEC 4).",
    ),
    answer(
        "improvement",
        "little improvement",
        "L < 1, or L₋₅ − L < 0.5 % of L₋₅: the paper's words (5.5.4). A loss that rises counts as converged.",
    ),
];

pub(super) const OBJECTIVE: &[Answer] = &[
    answer("iou", "masks (IoU)", "One minus the soft IoU of the masks of the strongest τ_pct: the paper (4.3)."),
    answer(
        "ncc_db",
        "levels (NCC)",
        "One minus the correlation of the levels above the noise, dB: knows the pose better.",
    ),
    answer(
        "gamma",
        "levels (speckle)",
        "The Itakura–Saito divergence of the powers, the likelihood under speckle: sharpest, and of the narrowest basin.",
    ),
];

pub(super) const BODY: &[Answer] = &[
    answer("joints", "joints", "A Gaussian a joint: the paper."),
    answer(
        "skin",
        "skin",
        "Points on the side of trunk and limbs that faces the radar, as bright as what is seen of them.",
    ),
];

pub(super) const CLUTTER: &[Answer] = &[
    answer("none", "none", "Noise alone, as strong in every cell."),
    answer(
        "modelled",
        "by range",
        "The median of what is lit beside the person at each range joins the noise: sidelobes and walls are arcs. In a window also what does not change over time, but where the trunk of who stands is.",
    ),
];

pub(super) const STATIC_ECHO: &[Answer] = &[
    answer("kept", "kept", "As bright as one that moves: the paper."),
    answer(
        "fitted",
        "fitted",
        "Radars take away the mean over a frame's chirps, and with it what stands still. How much is left of a joint at rest is fitted; opacities show it.",
    ),
];

pub(super) const SUMMATION: &[Answer] = &[
    answer("coherent", "coherent", "H_sim = |Σ A K e^{iψ}|: joints interfere. The paper."),
    answer("incoherent", "incoherent", "H_sim = √Σ (A K)²: powers add."),
];

pub(super) const RANGE_OFFSET: &[Answer] = &[
    answer("stated", "as stated", "What the manifest says, psf.range_offset_m of a view; 0 where it says nothing."),
    answer(
        "measured",
        "measured",
        "Besides what the maps tell: powers by range of the views of one place, shifted until they agree. Counts from 6 cm on, where it explains them clearly better.",
    ),
];

pub(super) const SIDELOBES: &[Answer] = &[
    answer("kept", "kept", "Part of H_ori, as any echo."),
    answer(
        "removed",
        "removed",
        "Their mean power is taken from H_ori, along range and along the sine of the angle, as far as they are there.",
    ),
];

pub(super) const LOBE: &[Answer] = &[
    answer("gaussian", "Gaussian", "One Gaussian a joint, of the width of psf: SPEC 3."),
    answer(
        "window",
        "the window's",
        "Down to its first minimum: a difference of Gaussians an axis, four to eight times the work. Where the sum is coherent and the view's FFTs are known ([view.fft]); a Gaussian elsewhere.",
    ),
];

pub(super) const PARAMETERIZATION: &[Answer] = &[
    answer("joints", "joints", "Every joint by itself: the paper."),
    answer("bones", "root and bones", "The root moves and turns, bones turn about their inner joint: lengths stay."),
    answer(
        "motion",
        "motion",
        "Place, heading, size and pose of a window of frames at once, in the space that real motion has taught. Powers along a Doppler axis add, and speckle finer than a limb is blurred.",
    ),
];

pub(super) const SCATTERERS: &[Answer] = &[
    answer("equal", "equal", "Round, all alike: the paper says nothing else."),
    answer("body_parts", "by body part", "Along the bones, as wide and bright as the part."),
];

pub(super) const YAW: &[Answer] = &[
    answer("radar", "at the radar", "The paper says nothing else."),
    answer("motion", "where it goes", "From its places in the frames around."),
];

pub(super) const PLACE: &[Answer] = &[
    answer(
        "peaks",
        "peaks",
        "Where a standing body put at the clusters of peaks is lit best in all views of this frame, moved to the middle of what is lit there: the middle of a cluster lies on whatever shines, not in a body.",
    ),
    answer("cluster", "cluster", "The middle of the strongest cluster of peaks, as it is: the paper (4.1.2)."),
    answer(
        "counted",
        "frames around",
        "One person stands where counting over the frames around finds it, if the peaks alone show somebody elsewhere.",
    ),
];

pub(super) const HEIGHT: &[Answer] = &[
    answer("echo", "echo", "The middle of the echo."),
    answer(
        "floor",
        "floor and head",
        "Where the data set tells the radar's height (height_m). A body in a window then stands on the floor in every pose, give or take 5 cm.",
    ),
];

pub(super) const FRAMES_AROUND: &[Answer] = &[
    answer(
        "both",
        "before and after",
        "What stands still, the count and where somebody goes are read from up to four frames on each side: a recording is there as a whole, and frames after tell as much as those before.",
    ),
    answer(
        "past",
        "before",
        "From the frames before alone: what a radar that runs can know. The paper counts over consecutive frames (appendix B) and starts from a frame alone (4.1).",
    ),
    answer("none", "none", "From the frame alone; people too are counted in it alone."),
];

pub(super) const STILL: &[Answer] = &[
    answer(
        "left_out",
        "left out",
        "What does not change over the frames around is furniture: it is no evidence of a person. A wall often outshines people.",
    ),
    answer("kept", "kept", "They count as all others do: the paper, whose peaks are those of H."),
];

pub(super) const BACKGROUND: &[Answer] = &[
    answer(
        "range",
        "at its range",
        "A cell counts by how far it rises over the median at its range: sidelobes and walls are arcs about the radar.",
    ),
    answer(
        "map",
        "of the map",
        "A cell counts by H itself: the paper, whose peaks are those above a percentile of H (4.1.1).",
    ),
];

pub(super) const GRADIENT: &[Answer] = &[
    answer(
        "flow",
        "with a sign",
        "v_r = ±γ·g without a Doppler axis, the sign that of the change to the nearest frame; 0 where there is none: a magnitude does not say whether somebody comes or goes.",
    ),
    answer(
        "magnitude",
        "magnitude",
        "v_r = γ·g of the frame alone, always away from the radar: appendix A as printed.",
    ),
];

pub(super) const WARM_START: &[Answer] = &[
    answer(
        "moved",
        "moved",
        "At the result of the frame before, moved as the echo moved since: 25 steps of a millimetre do not follow who walks.",
    ),
    answer("as_left", "as left", "At the result of the frame before as it is: the paper (5.5.4)."),
];
