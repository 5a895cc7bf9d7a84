//! The one table of settings: a row for each key of `FIT.toml`, in the order that they are shown.
//!
//! A new setting is a field of [`FitConfig`] with its default, and a row here.

use super::field::{Access, Answer, Field, FieldGroup, ReadBy, Unset, Value};
use super::rows::{choice, count_at, flag_at, maybe_at, number, number_at, one_of_at, switch};
use super::{
    Background, BodyModel, Clutter, Convergence, EM_REGION_FORM, EmLoss, EmRegion, FitConfig, FramesAround,
    GradientVelocity, Height, LobeShape, Parameterization, RangeOffset, Scatterers, Sidelobes, StartPlace, StaticEcho,
    Still, Summation, WHOLE_RANGE_DB, WarmStart, Yaw, answers,
};
use FieldGroup::{Limits, Model, Optimiser, Perturbation, Radar, Start as Starting, StepSizes, Weights};
use ReadBy::{Run, Start, Steps, StepsAndStart};

const EM_REGION: Access = (
    |c| match c.em_region {
        EmRegion::Full => Value::Unset,
        EmRegion::HalfWidth(half) => Value::Number(half),
    },
    |c, value| match value {
        Value::Unset => c.em_region = EmRegion::Full,
        Value::Number(half) => c.em_region = EmRegion::HalfWidth(half),
        Value::Switch(_) | Value::Answer(_) => {}
    },
);

const WHOLE_MAP: Unset = Unset {
    answer: Answer { word: "full", label: "whole map", help: "All cells: the paper (4.3)." },
    number: "±",
    first: 1.25,
    form: Some(EM_REGION_FORM),
};

const AS_ALL: Unset = Unset {
    answer: Answer { word: "unset", label: "as all", help: "That of all groups: the key is left out." },
    number: "own",
    first: 1e-3,
    form: None,
};

/// Every setting of [`FitConfig`], in the order it is shown.
pub const FIELDS: &[Field] = &[
    Field {
        help: "Weight of the electromagnetic term: L = w_EM·L_EM + w_kine·L_kine, L_EM = 1 − soft IoU of the masks of H_sim and H_ori.",
        ..number(Weights, "w_em", "w_EM", Steps, (0.0, 1000.0), number_at!(w_em)).logarithmic().row("weights")
    },
    Field {
        help: "Weight of the kinematic terms: bone lengths, rigid motion, joint angles, and for several people separation and collision.",
        ..number(Weights, "w_kine", "w_kine", Steps, (0.0, 1000.0), number_at!(w_kine)).logarithmic().row("weights")
    },
    Field {
        help: "What L_EM compares of H_sim and H_ori.",
        ..choice(
            Model,
            "objective",
            "Objective",
            StepsAndStart,
            answers::OBJECTIVE,
            one_of_at!(objective, [EmLoss::Iou, EmLoss::NccDb, EmLoss::Gamma]),
        )
        .row("objective")
    },
    Field {
        help: "What returns the simulated echo.",
        ..choice(
            Model,
            "body",
            "Body",
            StepsAndStart,
            answers::BODY,
            one_of_at!(body, [BodyModel::Joints, BodyModel::Skin]),
        )
        .row("body")
    },
    Field {
        help: "What levels know of echoes that are not the person's.",
        ..choice(
            Model,
            "clutter",
            "Clutter",
            StepsAndStart,
            answers::CLUTTER,
            one_of_at!(clutter, [Clutter::None, Clutter::Modelled]),
        )
        .row("clutter")
    },
    Field {
        help: "How bright a joint is that stands still, where the parameterization is motion.",
        ..choice(
            Model,
            "static_echo",
            "Static echo",
            StepsAndStart,
            answers::STATIC_ECHO,
            one_of_at!(static_echo, [StaticEcho::Kept, StaticEcho::Fitted]),
        )
        .row("static echo")
    },
    Field {
        help: "How far below the brightest cell of the EM region levels are told apart, where the objective is ncc_db: beyond are the sidelobes of the echo. 200: as far as the noise.",
        ..number(
            Model,
            "dynamic_range_db",
            "Dynamic range",
            StepsAndStart,
            (6.0, WHOLE_RANGE_DB),
            number_at!(dynamic_range_db),
        )
        .unit("dB")
        .row("dynamic range")
    },
    Field {
        help: "Share of the EM region's cells that a mask holds: B = [H > P_{100−τ}(H)]. At 100 % all but the smallest cell: no masking.",
        ..number(Weights, "tau_pct", "τ_pct", StepsAndStart, (0.1, 100.0), number_at!(tau_pct))
            .logarithmic()
            .unit("%")
            .row("threshold")
    },
    #[cfg(any(test, feature = "dummies"))]
    Field {
        help: "Weight of a term that only tests know.",
        ..number(Weights, "w_dummy", "w_dummy", Steps, (0.0, 1000.0), number_at!(w_dummy)).logarithmic().row("weights")
    },
    Field {
        help: "Weight of the prior of motion: how unlikely a window's coordinates are among those of real people.",
        ..number(Weights, "w_prior", "w_prior", Steps, (0.0, 1000.0), number_at!(w_prior)).logarithmic().row("motion")
    },
    Field {
        help: "Weight of what a network that looks at the maps alone expects, where the parameterization is motion; above 0 its bodies are starts, too.",
        ..number(Weights, "w_net", "w_net", StepsAndStart, (0.0, 1000.0), number_at!(w_net))
            .logarithmic()
            .row("network")
    },
    Field {
        help: "Weight of where joints were given, by a prediction, an annotation or your hand: they may be off by some 5 cm. A start that the program finds gives none.",
        ..number(Weights, "w_given", "w_given", Steps, (0.0, 1000.0), number_at!(w_given))
            .logarithmic()
            .row("given start")
    },
    Field {
        help: "Frames that are fitted together where the parameterization is motion.",
        ..number(Model, "window", "Window", StepsAndStart, (1.0, 9.0), count_at!(window)).whole().row("motion")
    },
    Field {
        help: "Frames on each side whose hypotheses decide with this frame's which of them is fitted (Viterbi), and whose bodies it tries; 0: a frame decides by itself.",
        ..number(Starting, "decode_frames", "Decoded frames", Start, (0.0, 60.0), count_at!(decode_frames))
            .whole()
            .row("decoding along the sequence")
    },
    Field {
        help: "Temperature of the soft mask m = σ((ln H_sim − ln P)/T): small is sharp, large spreads the gradient.",
        ..number(Optimiser, "softness", "T (softness)", StepsAndStart, (0.01, 10.0), number_at!(softness))
            .logarithmic()
            .row("softness")
    },
    Field {
        help: "Adam's step size for every group (m, ln m, m/s, … a step).",
        ..number(Optimiser, "learning_rate", "Learning rate", Steps, (1e-6, 1.0), number_at!(learning_rate))
            .logarithmic()
            .row("step sizes")
    },
    Field {
        help: "Adam steps of a run.",
        ..number(Optimiser, "iterations", "Iterations", Run, (1.0, 100_000.0), count_at!(iterations))
            .logarithmic()
            .whole()
            .row("iterations")
    },
    Field {
        help: "End a run as soon as the convergence criterion holds.",
        ..switch(Optimiser, "stop_when_converged", "Stop when converged", Run, flag_at!(stop_when_converged))
            .called("stop when converged")
            .row("early stop")
    },
    Field {
        help: "When five iterations count as no more progress.",
        ..choice(
            Optimiser,
            "convergence",
            "Converged",
            Steps,
            answers::CONVERGENCE,
            one_of_at!(convergence, [Convergence::Change, Convergence::Improvement]),
        )
        .row("convergence")
    },
    Field {
        help: "A = α·(r_max/d)⁴; off: A = α.",
        ..switch(Radar, "operators.attenuation", "attenuation", StepsAndStart, flag_at!(operators.attenuation))
            .row("operators")
    },
    Field {
        help: "Beat-frequency phase 2πSτ²; off: range axes see every joint at 0 m.",
        ..switch(Radar, "operators.range", "range", StepsAndStart, flag_at!(operators.range)).row("operators")
    },
    Field {
        help: "Phase 2π(2v_r/λ)T_frame and the ramp; off: Doppler axes see every joint at rest.",
        ..switch(Radar, "operators.doppler", "Doppler", StepsAndStart, flag_at!(operators.doppler)).row("operators")
    },
    Field {
        help: "Array phase; off: angular axes see every joint at boresight.",
        ..switch(Radar, "operators.angle", "angle", StepsAndStart, flag_at!(operators.angle)).row("operators")
    },
    Field {
        help: "How the joints' returns are combined.",
        ..choice(
            Radar,
            "summation",
            "Sum",
            StepsAndStart,
            answers::SUMMATION,
            one_of_at!(summation, [Summation::Coherent, Summation::Incoherent]),
        )
        .row("powers add")
    },
    Field {
        help: "The main lobe of a joint: one Gaussian, 2 to 15 % of the peak off the window's own, or that itself.",
        ..choice(
            Radar,
            "lobe",
            "Lobe",
            StepsAndStart,
            answers::LOBE,
            one_of_at!(lobe, [LobeShape::Gaussian, LobeShape::Window]),
        )
        .row("the window's lobe")
    },
    Field {
        help: "By how much the ranges of a map are too large: what the manifest states, or besides that what the maps tell, in which the radars of one place see the same echoes.",
        ..choice(
            Radar,
            "range_offset",
            "Range",
            StepsAndStart,
            answers::RANGE_OFFSET,
            one_of_at!(range_offset, [RangeOffset::Stated, RangeOffset::Measured]),
        )
        .row("range offsets measured")
    },
    Field {
        help: "What is done with the sidelobes of FFTs that no window tapers: every echo is a star in such maps. Only where a view's FFTs are known; whether sidelobes are there is measured.",
        ..choice(
            Radar,
            "sidelobes",
            "Sidelobes",
            StepsAndStart,
            answers::SIDELOBES,
            one_of_at!(sidelobes, [Sidelobes::Kept, Sidelobes::Removed]),
        )
        .row("sidelobes removed")
    },
    Field {
        help: "Where L_EM is computed: the whole map, or a box of this half width around the start pose.",
        ..number(Radar, "em_region", "EM region", StepsAndStart, (f64::from_bits(1), f64::MAX), EM_REGION)
            .offered(0.1, 20.0)
            .unit("m")
            .or(WHOLE_MAP)
            .row("EM region")
    },
    Field {
        help: "The echo of a body comes from its skin, not from the joint: p is moved this far towards the radar. 0 is the paper.",
        ..number(Radar, "surface_offset_m", "δ (skin)", StepsAndStart, (0.0, 0.5), number_at!(surface_offset_m))
            .unit("m")
            .row("skin in front of the joints")
    },
    Field {
        help: "Largest elbow and knee angle; beyond it L_joint = Σ max(0, θ − θ_max)² grows.",
        ..number(Limits, "theta_max_deg", "θ_max", Steps, (0.0, 180.0), number_at!(theta_max_deg))
            .unit("°")
            .row("limits")
    },
    Field {
        help: "How far a bone may be from its reference length at no cost: L_bone = Σ ψ(max(0, |l − ℓ| − tolerance)). The paper's formula has none (4.3), its list of settings has 5 cm (appendix D).",
        ..number(Limits, "bone_tolerance_m", "Bone tolerance", Steps, (0.0, 0.5), number_at!(bone_tolerance_m))
            .unit("m")
            .row("bone tolerance")
    },
    Field {
        help: "Several people: centroids closer than this are pushed apart, L_sep = Σ max(0, d_sep − ‖c_s − c_t‖)².",
        ..number(Limits, "d_sep_m", "d_sep", Steps, (0.0, 5.0), number_at!(d_sep_m)).unit("m").row("limits")
    },
    Field {
        help: "Several people: joints closer than this are pushed apart, L_coll = Σ max(0, d_joint − ‖p_sm − p_tn‖)².",
        ..number(Limits, "d_joint_m", "d_joint", Steps, (0.0, 1.0), number_at!(d_joint_m)).unit("m").row("limits")
    },
    Field {
        help: "A joint's Gaussian is a part of a body: no step makes its standard deviation larger than this along any of its axes. At 0.43 m four of them hold a whole body of 1.70 m. What is wider already may shrink. Acts on the step, not on the objective.",
        ..number(Limits, "scale_max_m", "s_max", StepsAndStart, (0.01, 10.0), number_at!(scale_max_m))
            .logarithmic()
            .unit("m")
            .row("limits")
    },
    Field {
        help: "What Adam moves.",
        ..choice(
            Model,
            "parameterization",
            "Moves",
            StepsAndStart,
            answers::PARAMETERIZATION,
            one_of_at!(parameterization, [Parameterization::Joints, Parameterization::Bones, Parameterization::Motion]),
        )
        .row("bones turn")
    },
    Field {
        help: "What the Gaussians of a start look like.",
        ..choice(
            Model,
            "scatterers",
            "Gaussians",
            Start,
            answers::SCATTERERS,
            one_of_at!(scatterers, [Scatterers::Equal, Scatterers::BodyParts]),
        )
        .row("scales and opacities by body part")
    },
    Field {
        help: "Where a start looks.",
        ..choice(Model, "yaw", "Looks", Start, answers::YAW, one_of_at!(yaw, [Yaw::Radar, Yaw::Motion]))
            .row("heading from motion")
    },
    Field {
        help: "What tells where the start of one person stands.",
        ..choice(
            Model,
            "place",
            "Place",
            Start,
            answers::PLACE,
            one_of_at!(place, [StartPlace::Peaks, StartPlace::Cluster, StartPlace::Counted]),
        )
        .row("place")
    },
    Field {
        help: "What tells how high somebody stands.",
        ..choice(
            Model,
            "height",
            "Height",
            StepsAndStart,
            answers::HEIGHT,
            one_of_at!(height, [Height::Echo, Height::Floor]),
        )
        .row("height from the floor")
    },
    Field {
        help: "Weight of the temporal term: L_time = Σ ‖c − ĉ‖² (m²), c the mean of a person's joints, ĉ where a line through its places in this frame and those around says it is. Only where a frame has neighbours. Above 0 a start stands on that line too. 0 is the paper.",
        ..number(Model, "w_time", "w_time", StepsAndStart, (0.0, 1000.0), number_at!(w_time))
            .logarithmic()
            .row("temporal term")
    },
    Field {
        help: "Step size of the positions of the joints, or of the root (m).",
        ..number(StepSizes, "learning_rates.position", "η_p", Steps, (0.0, 1.0), maybe_at!(learning_rates.position))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of the turns of root and bones (rad); only where bones are moved. 0: the body moves as one.",
        ..number(StepSizes, "learning_rates.bone", "η_bone", Steps, (0.0, 1.0), maybe_at!(learning_rates.bone))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of ln s.",
        ..number(StepSizes, "learning_rates.log_scale", "η_s", Steps, (0.0, 1.0), maybe_at!(learning_rates.log_scale))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of the quaternions.",
        ..number(StepSizes, "learning_rates.rotation", "η_q", Steps, (0.0, 1.0), maybe_at!(learning_rates.rotation))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of the velocities (m/s).",
        ..number(StepSizes, "learning_rates.velocity", "η_v", Steps, (0.0, 1.0), maybe_at!(learning_rates.velocity))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of the opacities before the sigmoid.",
        ..number(StepSizes, "learning_rates.beta", "η_β", Steps, (0.0, 1.0), maybe_at!(learning_rates.beta))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Step size of the Doppler features.",
        ..number(StepSizes, "learning_rates.omega", "η_ω", Steps, (0.0, 1.0), maybe_at!(learning_rates.omega))
            .logarithmic()
            .or(AS_ALL)
            .row("step sizes")
    },
    Field {
        help: "Off: the body stands in the middle of what the views cover.",
        ..switch(Starting, "init.position", "P: positions from the peaks", Start, flag_at!(init.position))
            .called("P")
            .row("initialiser")
    },
    Field {
        help: "From the Doppler axis, or from the intensity gradients of consecutive maps. Off: 0.",
        ..switch(Starting, "init.velocity", "V: velocities from the maps", Start, flag_at!(init.velocity))
            .called("V")
            .row("initialiser")
    },
    Field {
        help: "Which frames beside its own a start may look at.",
        ..choice(
            Starting,
            "frames_around",
            "Frames",
            Start,
            answers::FRAMES_AROUND,
            one_of_at!(frames_around, [FramesAround::Both, FramesAround::Past, FramesAround::None]),
        )
        .row("frames around")
    },
    Field {
        help: "What becomes of echoes that do not change over the frames around.",
        ..choice(
            Starting,
            "init.still",
            "Still echoes",
            Start,
            answers::STILL,
            one_of_at!(init.still, [Still::LeftOut, Still::Kept]),
        )
        .row("still echoes")
    },
    Field {
        help: "What a cell is compared with before it counts as an echo.",
        ..choice(
            Starting,
            "init.background",
            "Background",
            Start,
            answers::BACKGROUND,
            one_of_at!(init.background, [Background::Range, Background::Map]),
        )
        .row("background")
    },
    Field {
        help: "How an intensity gradient becomes a velocity.",
        ..choice(
            Starting,
            "init.gradient",
            "Gradient",
            Start,
            answers::GRADIENT,
            one_of_at!(init.gradient, [GradientVelocity::Flow, GradientVelocity::Magnitude]),
        )
        .row("gradient's velocity")
    },
    Field {
        help: "Where a warm start begins.",
        ..choice(
            Starting,
            "warm_start",
            "Warm start",
            ReadBy::WarmStart,
            answers::WARM_START,
            one_of_at!(warm_start, [WarmStart::Moved, WarmStart::AsLeft]),
        )
        .row("warm start")
    },
    Field {
        help: "Persons that are fitted at once; 0 fits as many as are counted.",
        ..number(Starting, "people", "People", Start, (0.0, 8.0), count_at!(people))
            .whole()
            .zero("counted")
            .row("people")
    },
    Field {
        help: "Postures that are tried at the place of the start, the one with the smallest L_EM is fitted: standing, then for who walks several moments of a stride, for others raised arms and sitting where they are clearly better. 1 is the paper: standing.",
        ..number(Starting, "starts", "Starts", Start, (1.0, 25.0), count_at!(starts)).whole().row("several starts")
    },
    Field {
        help: "Without a Doppler axis the start's speed is γ times the normalised intensity gradient of consecutive maps (appendix A).",
        ..number(Starting, "init.velocity_gain_mps", "γ", Start, (0.0, 5.0), number_at!(init.velocity_gain_mps))
            .unit("m/s")
            .row("initialiser")
    },
    Field {
        help: "Perturbation: standard deviation of Gaussian noise on every coordinate of every joint of a start, from the peaks or from the frame before.",
        ..number(Perturbation, "init.position_noise_m", "σ_p", Start, (0.0, 1.0), number_at!(init.position_noise_m))
            .unit("m")
    },
    Field {
        help: "Perturbation: the whole start is shifted this far in a direction drawn for each frame.",
        ..number(Perturbation, "init.position_bias_m", "Δp", Start, (0.0, 1.0), number_at!(init.position_bias_m))
            .unit("m")
    },
    Field {
        help: "Perturbation: standard deviation of Gaussian noise on every component of every start velocity.",
        ..number(Perturbation, "init.velocity_noise_mps", "σ_v", Start, (0.0, 5.0), number_at!(init.velocity_noise_mps))
            .unit("m/s")
    },
    Field {
        help: "Perturbation: share of the detected peaks that is missed at random before they are clustered, each with its hill of the map.",
        ..number(Perturbation, "init.peak_dropout", "r_drop", Start, (0.0, 0.95), number_at!(init.peak_dropout))
    },
    Field {
        help: "Seed of the perturbations; each frame draws its own numbers from it.",
        ..number(Perturbation, "init.seed", "Seed", Start, (0.0, 1e9), count_at!(init.seed)).whole()
    },
];
