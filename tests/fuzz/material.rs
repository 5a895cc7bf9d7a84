//! What the mutations begin with: the smallest sound file of every kind, and archives whose headers say what one likes.

use rand::Rng as _;
use rand::rngs::StdRng;
use rand::seq::IndexedRandom as _;
use std::io::{Cursor, Write as _};
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

/// A file below the folder of a data set.
pub(crate) type File = (&'static str, Vec<u8>);

pub(crate) const MANIFEST: &str = r#"name = "case"
layout = "npz"
frames = "frames/*.npz"
frame_rate_hz = 10.0
skeleton = "coco17"

[radar]
start_hz = 77e9
bandwidth_hz = 2.5e9
chirp_s = 60e-6
frame_s = 0.0128
r_max_m = 12.0
l_az_m = 0.0019
l_el_m = 0.0019
doppler_features = 4

[[view]]
array = "hori"
psf = { range_m = 0.06, azimuth_rad = 0.03, elevation_rad = 0.0, doppler_mps = 0.1 }
rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation = [0, 0, 0]
axes = [
  { kind = "depth_h", bins = 12, lo = 6.0, hi = 0.0 },
  { kind = "y", bins = 8, lo = 2.0, hi = -2.0 },
]

[[view]]
array = "vert"
quantity = "power"
psf = { range_m = 0.06, azimuth_rad = 0.03, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [
  { kind = "range", bins = 12, lo = 0.0, hi = 6.0 },
  { kind = "azimuth", bins = 8, lo = -1.0, hi = 1.0, spacing = "sine" },
]
region = [[0, 12], [0, 8]]
"#;

/// The npy file of `data`, little-endian, under a header of one's choice.
pub(crate) fn npy(descr: &str, shape: &str, fortran: bool, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while !(10 + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    bytes.extend(data);
    bytes
}

/// A sound archive of these entries, with their sums.
pub(crate) fn npz(entries: &[(&str, Vec<u8>)], deflate: bool) -> Vec<u8> {
    let method = if deflate { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
    let options = zip::write::FileOptions::default().compression_method(method);
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (key, bytes) in entries {
        archive.start_file(format!("{key}.npy"), options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// The configuration of small captures: two transmitters in turn, two loops, eight samples.
const CHIRP: &str = r"
[capture.chirp]
start_ghz = 77.0
slope_mhz_per_us = 60.0
idle_us = 7.0
adc_start_us = 5.0
ramp_us = 60.0
samples = 8
rate_ksps = 5000.0
loops = 2
tx = [0, 1]
rx = 2
period_ms = 100.0
";

/// A radar's file as `calibrate --save` keeps it.
pub(crate) const RADAR: &str = r#"about = "a lab's radar"
[radar]
start_hz = 77e9
bandwidth_hz = 2.5e9
chirp_s = 60e-6
frame_s = 0.0128
r_max_m = 12.0
l_az_m = 0.0019
l_el_m = 0.0019
doppler_features = 4
[fft]
samples = 64
chirps = 16
window = { range = "hann", doppler = "blackman", angle = "chebyshev-30" }
padding = { range = 2, doppler = 1, angle = 4 }
array = { azimuth = 8, elevation = 4, azimuth_m = 0.002 }
chirp = { bandwidth_hz = 2.4e9 }
[psf]
range_m = 0.05
azimuth_rad = 0.1
elevation_rad = 0.2
doppler_mps = 0.1
"#;

/// A cube of samples of two frames, (frames, loops, channels, samples) or as XRF55 has it, with a manifest that says its chirps.
pub(crate) fn sample_cube(segmented: bool) -> Vec<File> {
    let views =
        r#"views = ["range_azimuth", "range_doppler", "cube", "cartesian", "range_elevation", "cartesian_cube"]"#;
    let said =
        format!("layout = \"capture\"\nskeleton = \"coco17\"\nframes = \"cube.npy\"\n[capture]\n{views}\n{CHIRP}");
    let numbers = f4((0..2 * 64 * 2).map(|k| (k * 37 % 101) as f32));
    let shape = if segmented { "(2, 2, 8, 2, 2)" } else { "(2, 2, 4, 8)" };
    vec![("dataset.toml", said.into_bytes()), ("cube.npy", npy("<c8", shape, false, &numbers))]
}

/// Clips of samples as XRF55's raw variant has them.
pub(crate) fn raw_clip() -> Vec<File> {
    let numbers = f4((0..2 * 64 * 2).map(|k| (k * 37 % 101) as f32));
    vec![
        ("mmWave/01_02_03.npy", npy("<c8", "(2, 2, 8, 2, 2)", false, &numbers)),
        ("mmWave/01_02_04.npy", npy("<c8", "(2, 2, 8, 2, 2)", false, &numbers)),
    ]
}

/// The four files of a cascade with the JSON of its four chips, alone or where RT-Pose has them, with labels.
pub(crate) fn cascade(of_rt_pose: bool) -> Vec<File> {
    let device = |chip: usize| {
        format!(
            r#"{{"rfConfig":{{"rlChanCfg_t":{{"rxChannelEn":"0x3"}},"rlAdcOutCfg_t":{{"fmt":{{"b2AdcBits":2,"b2AdcOutFmt":1}}}},
            "rlProfiles":[{{"rlProfileCfg_t":{{"profileId":0,"startFreqConst_GHz":77.0,"idleTimeConst_usec":7.0,
            "adcStartTimeConst_usec":5.0,"rampEndTime_usec":60.0,"freqSlopeConst_MHz_usec":60.0,"numAdcSamples":8,
            "digOutSampleRate":5000}}}}],"rlChirps":[{{"rlChirpCfg_t":{{"chirpStartIdx":0,"chirpEndIdx":0,"profileId":0,
            "txEnable":"0x{}"}}}},{{"rlChirpCfg_t":{{"chirpStartIdx":1,"chirpEndIdx":1,"profileId":0,"txEnable":"0x{}"}}}}],
            "rlFrameCfg_t":{{"chirpStartIdx":0,"chirpEndIdx":1,"numLoops":2,"framePeriodicity_msec":100.0}}}}}}"#,
            u8::from(chip == 0),
            u8::from(chip == 1)
        )
    };
    let json = format!(r#"{{"mmWaveDevices":[{}]}}"#, (0..4).map(device).collect::<Vec<_>>().join(","));
    let words: Vec<u8> = (0..2 * 2 * 2 * 8 * 2 * 2_u16).flat_map(|k| (k * 37 % 101).to_le_bytes()).collect();
    if !of_rt_pose {
        let said = "layout = \"capture\"\n[capture]\nviews = [\"cartesian_cube\", \"range_azimuth\"]\n";
        return vec![
            ("dataset.toml", said.into()),
            ("a.mmwave.json", json.into_bytes()),
            ("master_0000_data.bin", words.clone()),
            ("slave1_0000_data.bin", words.clone()),
            ("slave2_0000_data.bin", words.clone()),
            ("slave3_0000_data.bin", words),
        ];
    }
    let mut files = rt_pose();
    files.retain(|(name, _)| !name.contains("npy"));
    files.push(("2023_0001/radar/a.mmwave.json", json.into_bytes()));
    for name in [
        "2023_0001/radar/bin/master_0000_data.bin",
        "2023_0001/radar/bin/slave1_0000_data.bin",
        "2023_0001/radar/bin/slave2_0000_data.bin",
        "2023_0001/radar/bin/slave3_0000_data.bin",
    ] {
        files.push((name, words.clone()));
    }
    files
}

/// HuPR's raw pair of captures: a frame of 786,432 bytes each.
pub(crate) fn raw_pair() -> Vec<File> {
    let words: Vec<u8> = (0..786_432_u32 / 2).flat_map(|k| ((k * 37 % 101) as u16).to_le_bytes()).collect();
    vec![("single_1/hori/adc_data.bin", words.clone()), ("single_1/vert/adc_data.bin", words)]
}

/// A raw capture of two frames with its configuration: words alone, with packet headers, as a `.pcap`, or with a JSON.
pub(crate) fn capture(which: usize) -> Vec<File> {
    let words: Vec<u8> = (0..2 * 2 * 2 * 2 * 8 * 2_u16).flat_map(|k| (k * 37 % 101).to_le_bytes()).collect();
    let packet = |number: u32, at: usize, data: &[u8]| {
        let count = (at as u64).to_le_bytes();
        [&number.to_le_bytes()[..], &count[..6], data].concat()
    };
    let cfg = "channelCfg 3 3 0\nadcCfg 2 1\nprofileCfg 0 77 7 5 60 0 0 60 1 8 5000 0 0 30\nchirpCfg 0 0 0 0 0 0 0 1\n\
               chirpCfg 1 1 0 0 0 0 0 2\nframeCfg 0 1 2 0 100 1 0\n";
    let json = r#"{"mmWaveDevices":[{"rfConfig":{"rlChanCfg_t":{"rxChannelEn":"0x3"},"rlAdcOutCfg_t":{"fmt":{"b2AdcBits":2,
        "b2AdcOutFmt":1}},"rlProfiles":[{"rlProfileCfg_t":{"profileId":0,"startFreqConst_GHz":77.0,"idleTimeConst_usec":7.0,
        "adcStartTimeConst_usec":5.0,"rampEndTime_usec":60.0,"freqSlopeConst_MHz_usec":60.0,"numAdcSamples":8,
        "digOutSampleRate":5000}}],"rlChirps":[{"rlChirpCfg_t":{"chirpStartIdx":0,"chirpEndIdx":0,"profileId":0,"txEnable":"0x1"}},
        {"rlChirpCfg_t":{"chirpStartIdx":1,"chirpEndIdx":1,"profileId":0,"txEnable":"0x2"}}],"rlFrameCfg_t":{"chirpStartIdx":0,
        "chirpEndIdx":1,"numLoops":2,"framePeriodicity_msec":100.0}},"rawDataCaptureConfig":{"rlDevLaneEnable_t":{"laneEn":"0x3"}}}]}"#;
    match which {
        0 => vec![("adc_data.bin", words), ("a.cfg", cfg.into())],
        1 => vec![("adc_data.bin", packet(1, 0, &words)), ("a.cfg", cfg.into())],
        2 => {
            let mut pcap = [&0xA1B2_C3D4_u32.to_le_bytes()[..], &[0; 20]].concat();
            for (k, data) in words.chunks(100).enumerate() {
                let udp = packet(k as u32 + 1, 100 * k, data);
                let len = (udp.len() as u16 + 8).to_be_bytes();
                let head = [&[0; 12][..], &[8, 0, 0x45], &[0; 8], &[17], &[0; 10], &[0x10, 2, 0x10, 2], &len, &[0; 2]]
                    .concat();
                let frame = [head, udp].concat();
                let size = (frame.len() as u32).to_le_bytes();
                pcap.extend([&[0; 8][..], &size, &size, &frame].concat());
            }
            vec![("a.pcap", pcap), ("a.cfg", cfg.into())]
        }
        _ => vec![("adc_data.bin", words), ("a.mmwave.json", json.into())],
    }
}

pub(crate) fn f4(numbers: impl IntoIterator<Item = f32>) -> Vec<u8> {
    numbers.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// A map of 12 × 8 cells with one echo.
pub(crate) fn map() -> Vec<u8> {
    f4((0..96).map(|cell| {
        0.1 + 5.0 * (-((cell / 8 - 6) * (cell / 8 - 6) + (cell % 8 - 4) * (cell % 8 - 4)) as f32 / 4.0).exp()
    }))
}

fn array(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    npy(descr, shape, false, data)
}

/// The frame of the manifest above.
pub(crate) fn frame() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("hori", array("<f4", "(12, 8)", &map())),
        ("vert", array("<f4", "(12, 8)", &map())),
        ("joints", array("<f4", "(1, 17, 3)", &f4((0..51).map(|k| 2.0 + (k % 7) as f32 * 0.1)))),
        ("velocities", array("<f4", "(1, 17, 3)", &f4((0..51).map(|_| 0.1)))),
        ("person_count", array("<i8", "()", &1_i64.to_le_bytes())),
        ("timestamp_s", array("<f8", "(1,)", &0.5_f64.to_le_bytes())),
    ]
}

/// Changes one entry of an archive: its header or its numbers, the rest being sound.
pub(crate) fn hostile_entry(entries: &mut [(&str, Vec<u8>)], random: &mut StdRng) {
    const SHAPES: [&str; 16] = [
        "()",
        "(0,)",
        "(1,)",
        "(12, 8)",
        "(8, 12)",
        "(96,)",
        "(3, 12, 8)",
        "(268435456,)",
        "(16384, 16384)",
        "(0, 12, 8)",
        "(1, 17, 3)",
        "(5000000, 17, 3)",
        "(4294967296, 4294967296)",
        "(1, 1, 1, 1, 1, 1, 1)",
        "(257, 17, 3)",
        "(12, 8, 0)",
    ];
    const DTYPES: [&str; 16] = [
        "<f4",
        "<f8",
        ">f4",
        "<f2",
        "<i8",
        "|u1",
        "|b1",
        "<U5",
        "<U268435456",
        "|S7",
        "<c8",
        "<c16",
        "|O",
        "<M8[ns]",
        "<f16",
        "<U0",
    ];
    let last = entries.len() - 1;
    let (_, entry) = &mut entries[random.random_range(0..=last)];
    let mut data = entry.get(128..).unwrap_or_default().to_vec();
    match random.random_range(0..4) {
        0 => data = vec![0; random.random_range(0..200_000)],
        1 => super::mutate::bytes(&mut data, random),
        _ => {}
    }
    let specials = [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, 0.0, -1.0, 1e-40];
    if random.random_bool(0.3) {
        let number = specials.choose(random).copied().unwrap_or(0.0).to_le_bytes();
        let all: bool = random.random();
        for chunk in data.chunks_exact_mut(4).filter(|_| all || random.random_bool(0.1)) {
            chunk.copy_from_slice(&number);
        }
    }
    let descr = DTYPES.choose(random).copied().unwrap_or("<f4");
    let shape = SHAPES.choose(random).copied().unwrap_or("()");
    *entry = match random.random_range(0..4) {
        0 => npy("<f4", "(12, 8)", random.random(), &data),
        1 => npy("<f4", shape, random.random(), &data),
        2 => npy(descr, "(12, 8)", random.random(), &data),
        _ => npy(descr, shape, random.random(), &data),
    };
}

/// Writes files below a folder.
pub(crate) fn lay_out(folder: &Path, files: &[(String, Vec<u8>)]) {
    for (name, bytes) in files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

/// An MMVR segment of 12 × 8 maps with all companions.
pub(crate) fn mmvr() -> Vec<File> {
    let manifest = MANIFEST.replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"mmvr\"");
    let one = |key, array| npz(&[(key, array)], true);
    vec![
        ("dataset.toml", manifest.into_bytes()),
        ("d1s1/000/00001_radar.npz", npz(&frame()[..2], true)),
        (
            "d1s1/000/00001_meta.npz",
            one(
                "global_frame_id",
                array("<U5", "()", &"00476".chars().flat_map(|c| u32::from(c).to_le_bytes()).collect::<Vec<u8>>()),
            ),
        ),
        (
            "d1s1/000/00001_bbox.npz",
            npz(
                &[
                    ("bbox_i", array("<f4", "(1, 5)", &f4([1.0, 2.0, 3.0, 4.0, 0.9]))),
                    ("bbox_hori", array("<f4", "(1, 4)", &f4([1.0, 2.0, 3.0, 4.0]))),
                    ("bbox_vert", array("<f4", "(1, 4)", &f4([1.0, 2.0, 3.0, 4.0]))),
                ],
                true,
            ),
        ),
        ("d1s1/000/00001_pose.npz", one("kp", array("<f4", "(1, 17, 3)", &f4((0..51).map(|k| k as f32))))),
        ("d1s1/000/00001_mask.npz", one("mask", array("|b1", "(1, 6, 8)", &[1; 48]))),
        ("d1s1/000/00001_truth.npz", npz(&frame()[2..], true)),
        ("d1s1/000/00002_radar.npz", npz(&frame()[..2], false)),
    ]
}

/// A HuPR sequence of cubes of 4 × 4 × 4 × 8, with annotations and truth.
pub(crate) fn hupr() -> Vec<File> {
    let manifest = MANIFEST
        .replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"hupr\"")
        .replace("bins = 12", "bins = 4")
        .replace("bins = 8", "bins = 4")
        .replace("region = [[0, 12], [0, 8]]\n", "")
        .replace(
            "  { kind = \"depth_h\"",
            "  { kind = \"doppler\", bins = 4, lo = -2.0, hi = 2.0 },\n  { kind = \"depth_h\"",
        )
        .replace(
            "  { kind = \"range\"",
            "  { kind = \"doppler\", bins = 4, lo = -2.0, hi = 2.0 },\n  { kind = \"range\"",
        );
    let cube = || npy("<c8", "(4, 4, 4, 8)", false, &f4((0..1024).map(|k| (k % 13) as f32)));
    let joints = vec!["[1.0, 2.0]"; 14].join(", ");
    let annotations = format!("[[{{\"image\": \"000000000.jpg\", \"joints\": [{joints}], \"bbox\": [1, 2, 3, 4]}}]]");
    vec![
        ("dataset.toml", manifest.into_bytes()),
        ("single_1/hori/000000000.npy", cube()),
        ("single_1/vert/000000000.npy", cube()),
        ("single_1/truth/000000000.npz", npz(&frame()[2..], false)),
        ("hrnet_annot_train.json", annotations.into_bytes()),
    ]
}

/// An XRF55 clip of 17 maps of 12 × 8.
pub(crate) fn xrf55() -> Vec<File> {
    let manifest = MANIFEST.replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"xrf55\"");
    let manifest = manifest[..manifest.rfind("[[view]]").unwrap_or(0)].to_owned();
    let clip: Vec<u8> = (0..17).flat_map(|_| map()).collect();
    vec![
        ("dataset.toml", manifest.into_bytes()),
        ("mmWave/01_02_03.npy", npy("<f4", "(17, 12, 8)", false, &clip)),
        ("mmWave/01_02_04.npy", npy("<f4", "(1, 17, 12, 8)", false, &clip)),
        ("mmWave/01_02_03_truth_00.npz", npz(&frame()[2..], false)),
    ]
}

/// Where a radar stands in a room.
pub(crate) const ROOMS: &str = r#"[[room]]
environment = "01"
rotation = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
translation_m = [1.0, 2.0, -1.0]
residual_m = 0.05
frames = [180, 200]
"#;

/// A group of HIBER of two frames of 12 × 8 maps with all labels, and where its radar stands.
pub(crate) fn hiber() -> Vec<File> {
    let manifest = MANIFEST
        .replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"hiber\"")
        .replace("coco17", "hiber14");
    let both: Vec<u8> = [map(), map()].concat();
    let joints = f4((0..84).map(|k| 1.0 + (k % 7) as f32 * 0.1));
    let label = |shape: &str, n: usize| npy("<f4", shape, false, &f4((0..n).map(|k| k as f32)));
    vec![
        ("dataset.toml", manifest.into_bytes()),
        ("WALK/HORIZONTAL_HEATMAPS/01_02/0000.npy", npy("<f4", "(2, 12, 8)", false, &both)),
        ("WALK/VERTICAL_HEATMAPS/01_02/0000.npy", npy("<f4", "(12, 8, 2)", false, &both)),
        ("WALK/HORIZONTAL_HEATMAPS/01_02/0001.npy", npy("<c8", "(12, 8)", false, &both)),
        ("WALK/VERTICAL_HEATMAPS/01_02/0001.npy", npy("<f4", "(12, 8)", false, &map())),
        ("WALK/ANNOTATIONS/3DPOSE/01_02.npy", npy("<f4", "(2, 1, 14, 3)", false, &joints)),
        ("WALK/ANNOTATIONS/2DPOSE/01_02.npy", label("(2, 1, 14, 2)", 56)),
        ("WALK/ANNOTATIONS/BOUNDINGBOX/HORIZONTAL/01_02.npy", label("(2, 1, 4)", 8)),
        ("WALK/ANNOTATIONS/BOUNDINGBOX/VERTICAL/01_02.npy", label("(2, 1, 4)", 8)),
        ("WALK/ANNOTATIONS/SILHOUETTE/01_02/0000.npy", npy("|b1", "(1, 6, 8)", false, &[1; 48])),
        ("WALK/ANNOTATIONS/SILHOUETTE/01_02/0001.npy", npy("|u1", "(1, 6, 8)", false, &[1; 48])),
        ("rooms.toml", ROOMS.as_bytes().to_vec()),
    ]
}

/// A sequence of RT-Pose of cubes of 4 × 3 × 8 cells with three Doppler bins and without, with its labels.
pub(crate) fn rt_pose() -> Vec<File> {
    let manifest = MANIFEST.replace("layout = \"npz\"\nframes = \"frames/*.npz\"", "layout = \"rt_pose\"");
    let manifest = manifest[..manifest.find("[[view]]").unwrap_or(0)].replace("coco17", "rt_pose15")
        + r#"[[view]]
array = "cube"
psf = { range_m = 0.05, azimuth_rad = 0.02, elevation_rad = 0.14, doppler_mps = 0.2 }
axes = [
  { kind = "z", bins = 4, lo = -1.0, hi = 1.0 },
  { kind = "y", bins = 3, lo = -1.5, hi = 1.5 },
  { kind = "x", bins = 8, lo = 0.0, hi = 4.0 },
]
"#;
    let cube: Vec<u8> = (0..96 * 3_u16).flat_map(|k| (0x3c00 + k % 77).to_le_bytes()).collect();
    let joints = vec!["[1.0, 2.0, 0.5]"; 15].join(", ");
    let labels = format!("{{\"1\": {{\"0\": [{{\"Radar_frameID\": \"000000\", \"pose\": [{joints}]}}]}}}}");
    vec![
        ("dataset.toml", manifest.into_bytes()),
        ("2023_0001/DZYX_npy_f16/000000.npy", npy("<f2", "(3, 4, 3, 8)", false, &cube)),
        ("2023_0002/npy/000000.npy", npy("<f4", "(4, 3, 8)", false, &map())),
        ("Train.json", labels.into_bytes()),
        ("file_meta.txt", b"1,2023_0001\n2,2023_0002\n".to_vec()),
        ("calib/calib.json", br#"{"radar": {"extrinsic": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}}"#.to_vec()),
    ]
}

/// A session file.
pub(crate) fn session() -> String {
    let config = mhp_inspector::config::FitConfig::default().to_toml();
    let file = serde_json::json!({
        "format": "mhp-session", "version": 1, "program": "0.1.0",
        "dataset": { "absolute": "/data/walk", "relative": "walk", "fingerprint": "9f0c" },
        "frame": { "path": "d1s1/000/00001", "index": 1 },
        "config": config, "single_precision": true, "warm_start": false,
        "view": mhp_inspector::session::ViewState::default(),
        "filter": "stratum:hard", "joint": 3, "fit": null, "pins": [], "baseline": null, "window": {},
    });
    file.to_string()
}

/// The text files of a run as a study of two small frames leaves it.
pub(crate) fn run_folder() -> &'static [(String, String)] {
    static FILES: OnceLock<Vec<(String, String)>> = OnceLock::new();
    FILES.get_or_init(|| {
        let home = tempfile::tempdir().unwrap();
        let (data, run) = (home.path().join("data"), home.path().join("run"));
        let frame = npz(&frame(), false);
        let files = [("dataset.toml", MANIFEST.as_bytes()), ("frames/0.npz", &frame), ("frames/1.npz", &frame)];
        lay_out(&data, &files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())));
        let study = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"))
            .args(["study", "sweep", "--preset", "baseline", "--grid", "w_em=0.1,0.5", "--iterations", "2"])
            .arg(&data)
            .arg("--out")
            .arg(&run)
            .output()
            .unwrap();
        assert!(study.status.success(), "{}", String::from_utf8_lossy(&study.stderr));
        let names = ["run.toml", "journal.jsonl", "rows.csv", "table.json", "table.md"];
        names.map(|name| (name.to_owned(), std::fs::read_to_string(run.join(name)).unwrap())).to_vec()
    })
}
