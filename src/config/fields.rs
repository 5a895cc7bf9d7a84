//! The numbers of [`FitConfig`] one by one: label, meaning, unit, range. Sliders, tooltips and checks read this table.

use super::FitConfig;

/// Which part of the settings a field belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldGroup {
    /// What is weighed against what.
    Weights,
    /// The optimiser and its regularisation.
    Optimiser,
    /// What the paper's objective lacks.
    Regularisation,
    /// The radar's simulation.
    Radar,
    /// Kinematic limits.
    Limits,
    /// How a start is found.
    Start,
    /// How a start is perturbed on purpose.
    Perturbation,
}

impl FieldGroup {
    /// The fields of this group, in the order they are shown.
    pub fn fields(self) -> impl Iterator<Item = &'static Field> {
        FIELDS.iter().filter(move |field| field.group == self)
    }
}

/// How a number of [`FitConfig`] is edited and explained.
pub struct Field {
    /// The key in `FIT.toml`; `table.key` inside a table.
    pub key: &'static str,
    /// Where it is shown.
    pub group: FieldGroup,
    /// The label on screen, in the paper's notation.
    pub label: &'static str,
    /// Meaning and formula.
    pub help: &'static str,
    /// Unit, or "".
    pub unit: &'static str,
    /// Inclusive range that is accepted.
    pub range: (f64, f64),
    /// Whether the slider is logarithmic.
    pub logarithmic: bool,
    /// Reads the number.
    pub get: fn(&FitConfig) -> f64,
    /// Writes the number.
    pub set: fn(&mut FitConfig, f64),
}

/// Every number of [`FitConfig`], in the order it is shown.
pub const FIELDS: &[Field] = &[
    Field {
        key: "w_em",
        group: FieldGroup::Weights,
        label: "w_EM",
        help: "Weight of the electromagnetic term: L = w_EM·L_EM + w_kine·L_kine, L_EM = 1 − soft IoU of the masks of H_sim and H_ori.",
        unit: "",
        range: (0.0, 1000.0),
        logarithmic: true,
        get: |c| c.w_em,
        set: |c, x| c.w_em = x,
    },
    Field {
        key: "w_kine",
        group: FieldGroup::Weights,
        label: "w_kine",
        help: "Weight of the kinematic terms: bone lengths, rigid motion, joint angles, and for several people separation and collision.",
        unit: "",
        range: (0.0, 1000.0),
        logarithmic: true,
        get: |c| c.w_kine,
        set: |c, x| c.w_kine = x,
    },
    Field {
        key: "tau_pct",
        group: FieldGroup::Weights,
        label: "τ_pct",
        help: "Share of the EM region's cells that a mask holds: B = [H > P_{100−τ}(H)]. At 100 % all but the smallest cell: no masking.",
        unit: "%",
        range: (0.1, 100.0),
        logarithmic: true,
        get: |c| c.tau_pct,
        set: |c, x| c.tau_pct = x,
    },
    #[cfg(test)]
    Field {
        key: "w_dummy",
        group: FieldGroup::Weights,
        label: "w_dummy",
        help: "Weight of a term that only tests know.",
        unit: "",
        range: (0.0, 1000.0),
        logarithmic: true,
        get: |c| c.w_dummy,
        set: |c, x| c.w_dummy = x,
    },
    Field {
        key: "softness",
        group: FieldGroup::Optimiser,
        label: "T (softness)",
        help: "Temperature of the soft mask m = σ((ln H_sim − ln P)/T): small is sharp, large spreads the gradient.",
        unit: "",
        range: (0.01, 10.0),
        logarithmic: true,
        get: |c| c.softness,
        set: |c, x| c.softness = x,
    },
    Field {
        key: "learning_rate",
        group: FieldGroup::Optimiser,
        label: "Learning rate",
        help: "Adam's step size for every group (m, ln m, m/s, … a step).",
        unit: "",
        range: (1e-6, 1.0),
        logarithmic: true,
        get: |c| c.learning_rate,
        set: |c, x| c.learning_rate = x,
    },
    Field {
        key: "iterations",
        group: FieldGroup::Optimiser,
        label: "Iterations",
        help: "Adam steps of a run.",
        unit: "",
        range: (1.0, 100_000.0),
        logarithmic: true,
        get: |c| c.iterations as f64,
        set: |c, x| c.iterations = x.round().max(0.0) as usize,
    },
    Field {
        key: "theta_max_deg",
        group: FieldGroup::Limits,
        label: "θ_max",
        help: "Largest elbow and knee angle; beyond it L_joint = Σ max(0, θ − θ_max)² grows.",
        unit: "°",
        range: (0.0, 180.0),
        logarithmic: false,
        get: |c| c.theta_max_deg,
        set: |c, x| c.theta_max_deg = x,
    },
    Field {
        key: "bone_tolerance_m",
        group: FieldGroup::Limits,
        label: "Bone tolerance",
        help: "How far a bone may be from its reference length at no cost: L_bone = Σ ψ(max(0, |l − ℓ| − tolerance)). The paper's formula has none (4.3), its list of settings has 5 cm (appendix D).",
        unit: "m",
        range: (0.0, 0.5),
        logarithmic: false,
        get: |c| c.bone_tolerance_m,
        set: |c, x| c.bone_tolerance_m = x,
    },
    Field {
        key: "surface_offset_m",
        group: FieldGroup::Radar,
        label: "δ (skin)",
        help: "The echo of a body comes from its skin, not from the joint: p is moved this far towards the radar. 0 is the paper.",
        unit: "m",
        range: (0.0, 0.5),
        logarithmic: false,
        get: |c| c.surface_offset_m,
        set: |c, x| c.surface_offset_m = x,
    },
    Field {
        key: "d_sep_m",
        group: FieldGroup::Limits,
        label: "d_sep",
        help: "Several people: centroids closer than this are pushed apart, L_sep = Σ max(0, d_sep − ‖c_s − c_t‖)².",
        unit: "m",
        range: (0.0, 5.0),
        logarithmic: false,
        get: |c| c.d_sep_m,
        set: |c, x| c.d_sep_m = x,
    },
    Field {
        key: "d_joint_m",
        group: FieldGroup::Limits,
        label: "d_joint",
        help: "Several people: joints closer than this are pushed apart, L_coll = Σ max(0, d_joint − ‖p_sm − p_tn‖)².",
        unit: "m",
        range: (0.0, 1.0),
        logarithmic: false,
        get: |c| c.d_joint_m,
        set: |c, x| c.d_joint_m = x,
    },
    Field {
        key: "scale_max_m",
        group: FieldGroup::Limits,
        label: "s_max",
        help: "A joint's Gaussian is a part of a body: no step makes its standard deviation larger than this along any of its axes. At 0.43 m four of them hold a whole body of 1.70 m. What is wider already may shrink. Acts on the step, not on the objective.",
        unit: "m",
        range: (0.01, 10.0),
        logarithmic: true,
        get: |c| c.scale_max_m,
        set: |c, x| c.scale_max_m = x,
    },
    Field {
        key: "w_time",
        group: FieldGroup::Regularisation,
        label: "w_time",
        help: "Weight of the temporal term: L_time = Σ ‖c − ĉ‖² (m²), c the mean of a person's joints, ĉ where a line through its places in this frame and those around says it is. Only where a frame has neighbours. Above 0 a start stands on that line too. 0 is the paper.",
        unit: "",
        range: (0.0, 1000.0),
        logarithmic: true,
        get: |c| c.w_time,
        set: |c, x| c.w_time = x,
    },
    Field {
        key: "people",
        group: FieldGroup::Start,
        label: "People",
        help: "Persons that are fitted at once; 0 fits as many as are counted. Takes effect when a start is found.",
        unit: "",
        range: (0.0, 8.0),
        logarithmic: false,
        get: |c| c.people as f64,
        set: |c, x| c.people = x.round().max(0.0) as usize,
    },
    Field {
        key: "starts",
        group: FieldGroup::Start,
        label: "Starts",
        help: "Postures that are tried at the place of the start, the one with the smallest L_EM is fitted: standing, then for who walks several moments of a stride, for others raised arms and sitting where they are clearly better. 1 is the paper: standing.",
        unit: "",
        range: (1.0, 16.0),
        logarithmic: false,
        get: |c| c.starts as f64,
        set: |c, x| c.starts = x.round().max(1.0) as usize,
    },
    Field {
        key: "init.velocity_gain_mps",
        group: FieldGroup::Start,
        label: "γ",
        help: "Without a Doppler axis the start's speed is γ times the normalised intensity gradient of consecutive maps (appendix A).",
        unit: "m/s",
        range: (0.0, 5.0),
        logarithmic: false,
        get: |c| c.init.velocity_gain_mps,
        set: |c, x| c.init.velocity_gain_mps = x,
    },
    Field {
        key: "init.position_noise_m",
        group: FieldGroup::Perturbation,
        label: "σ_p",
        help: "Perturbation: standard deviation of Gaussian noise on every coordinate of every joint of a start, from the peaks or from the frame before.",
        unit: "m",
        range: (0.0, 1.0),
        logarithmic: false,
        get: |c| c.init.position_noise_m,
        set: |c, x| c.init.position_noise_m = x,
    },
    Field {
        key: "init.position_bias_m",
        group: FieldGroup::Perturbation,
        label: "Δp",
        help: "Perturbation: the whole start is shifted this far in a direction drawn for each frame.",
        unit: "m",
        range: (0.0, 1.0),
        logarithmic: false,
        get: |c| c.init.position_bias_m,
        set: |c, x| c.init.position_bias_m = x,
    },
    Field {
        key: "init.velocity_noise_mps",
        group: FieldGroup::Perturbation,
        label: "σ_v",
        help: "Perturbation: standard deviation of Gaussian noise on every component of every start velocity.",
        unit: "m/s",
        range: (0.0, 5.0),
        logarithmic: false,
        get: |c| c.init.velocity_noise_mps,
        set: |c, x| c.init.velocity_noise_mps = x,
    },
    Field {
        key: "init.peak_dropout",
        group: FieldGroup::Perturbation,
        label: "r_drop",
        help: "Perturbation: share of the detected peaks that is missed at random before they are clustered, each with its hill of the map.",
        unit: "",
        range: (0.0, 0.95),
        logarithmic: false,
        get: |c| c.init.peak_dropout,
        set: |c, x| c.init.peak_dropout = x,
    },
    Field {
        key: "init.seed",
        group: FieldGroup::Perturbation,
        label: "Seed",
        help: "Seed of the perturbations; each frame draws its own numbers from it.",
        unit: "",
        range: (0.0, 1e9),
        logarithmic: false,
        get: |c| c.init.seed as f64,
        set: |c, x| c.init.seed = x.round().max(0.0) as u64,
    },
];
