//! Arrays on disk: what numpy writes is read as numpy meant it, what was written comes back, and no damaged or hostile
//! file does anything but give an error.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use mhp_inspector::body::{Group, Pppr, PpprShape};
use mhp_inspector::dataset::npz::{ArrayView, NPY_KEY, NpzArchive, NpzError, read_array, write, write_npy};
use mhp_inspector::dataset::{read_pppr, write_pppr};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// Written by numpy 2.4: `savez_compressed` of `arange(24).reshape(2, 3, 4)` in every real dtype, both byte orders, C and
/// Fortran order, and of what cannot be a map.
fn numpy_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/numpy.npz")
}

fn message<T>(result: Result<T, NpzError>) -> String {
    match result {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    }
}

/// The bytes of an npy file with this header.
fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn every_real_dtype_of_numpy_gives_the_same_numbers() {
    let mut file = NpzArchive::open(&numpy_file()).unwrap();
    let expected: Vec<f64> = (0..24).map(f64::from).collect();
    let mut checked = 0;
    for entry in file.entries().unwrap() {
        let real = entry.key.starts_with("le_") || entry.key.starts_with("be_") || entry.key[1..].starts_with('1');
        if real {
            let array = file.read(&entry.key).unwrap();
            assert_eq!(array.shape, [2, 3, 4], "{}", entry.key);
            assert_eq!(array.data, expected, "{}", entry.key);
            assert_eq!(array.dtype, entry.dtype);
            for (index, half) in expected.chunks(12).enumerate() {
                let slab = file.read_slab(&entry.key, index).unwrap();
                assert_eq!((slab.shape.as_slice(), slab.data.as_slice()), ([3, 4].as_slice(), half), "{}", entry.key);
            }
            checked += 1;
        }
    }
    assert_eq!(checked, 40);
    let (shape, flags) = file.read_flags("flags_fortran").unwrap();
    assert_eq!(shape, [2, 3, 4]);
    assert_eq!(flags, (0..24).map(|i| i % 3 == 0).collect::<Vec<_>>());
    assert_eq!(file.read("flags").unwrap().data[..4], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(file.read("signed").unwrap().data, [-1.0, -128.0, 127.0]);
    let special = file.read("special").unwrap().data;
    assert!(
        special[0].is_nan() && special[1..3] == [f64::INFINITY, f64::NEG_INFINITY] && special[3].is_sign_negative()
    );
    assert_eq!(file.read("empty").unwrap().shape, [0, 3]);
    assert_eq!(
        file.read("scalar").unwrap(),
        mhp_inspector::dataset::npz::Array { shape: Vec::new(), data: vec![1.5], dtype: "<f4".into() }
    );
}

#[test]
fn text_and_long_integers_are_read_in_full() {
    let mut file = NpzArchive::open(&numpy_file()).unwrap();
    assert_eq!(file.read_texts("text").unwrap(), ["00476"]);
    assert_eq!(file.read_texts("text_be").unwrap(), ["é", "ab"]);
    assert_eq!(file.read_texts("bytes").unwrap(), ["ab", "c"]);
    assert_eq!(file.read_texts("big").unwrap(), ["9007199254740993"]);
    assert_eq!(file.read_texts("unsigned_big").unwrap(), ["18446744073709551615"]);
}

#[test]
fn dtypes_that_cannot_be_maps_are_refused_by_name() {
    let mut file = NpzArchive::open(&numpy_file()).unwrap();
    assert!(message(file.read("objects")).contains("array `objects` holds pickled Python objects"));
    assert!(message(file.read_texts("objects")).contains("never loaded"));
    for (key, dtype) in [("complex", "<c16"), ("longdouble", "<f16"), ("text", "<U5"), ("datetime", "<M8[D]")] {
        let text = message(file.read(key));
        assert!(text.contains(&format!("array `{key}` has dtype {dtype}; expected real numbers")), "{text}");
    }
    assert!(message(file.read("record")).contains("array `record` has dtype"));
    assert!(message(file.read_flags("le_f4")).contains("expected bool"));
    let missing = message(file.read("hm_hori"));
    assert!(missing.contains("no array `hm_hori`; the file holds be_f2, be_f2_fortran"), "{missing}");
    assert!(message(file.read_slab("le_f4", 2)).contains("expected a first axis longer than 2"));
}

#[test]
fn what_is_written_comes_back_and_numpy_names_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let data = [1.0, f64::NAN, -0.0, 1e-300, 5.0, 6.0];
    let arrays = [
        ("map", ArrayView::f64(&[2, 3], &data)),
        ("half", ArrayView::f32(&[1, 2], &[0.5, -2.0])),
        ("count", ArrayView::i64(&[], &[7])),
        ("mask", ArrayView::flags(&[3], &[true, false, true])),
        ("id", ArrayView::text("00476")),
    ];
    write(&path, &arrays).unwrap();
    let first = std::fs::read(&path).unwrap();
    write(&path, &arrays).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), first, "the same arrays give the same bytes");
    let mut file = NpzArchive::open(&path).unwrap();
    assert_eq!(file.keys(), ["count", "half", "id", "map", "mask"]);
    let map = file.read("map").unwrap();
    assert_eq!(map.data.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), data.map(f64::to_bits));
    assert_eq!(file.read("half").unwrap().data, [0.5, -2.0]);
    assert_eq!(file.read("count").unwrap().data, [7.0]);
    assert_eq!(file.read_flags("mask").unwrap().1, [true, false, true]);
    assert_eq!(file.read_texts("id").unwrap(), ["00476"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");

    let single = folder.path().join("a.npy");
    write_npy(&single, &ArrayView::f64(&[3, 2], &data)).unwrap();
    assert_eq!(read_array(&single, NPY_KEY).unwrap().shape, [3, 2]);
}

#[test]
fn a_failed_write_leaves_the_old_file_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    write(&path, &[("x", ArrayView::f64(&[1], &[1.0]))]).unwrap();
    let wrong = write(&path, &[("x", ArrayView::f64(&[3], &[1.0]))]);
    assert!(message(wrong).contains("does not hold 1 elements"));
    assert_eq!(read_array(&path, "x").unwrap().data, [1.0]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert!(message(write(&folder.path().join("no/such/a.npz"), &[])).contains("cannot be written"));
}

#[test]
fn declared_sizes_are_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.npy");
    let header = |shape: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    for shape in ["(1000000, 1000000, 100)", "(4611686018427387904, 4)", "(9223372036854775807, 0, 8)"] {
        std::fs::write(&path, npy(&header(shape), &[0; 64])).unwrap();
        let text = message(read_array(&path, NPY_KEY));
        assert!(text.contains("refused before allocating") && text.contains("huge.npy"), "{text}");
    }
    std::fs::write(&path, npy(&header("(4,)"), &[0; 24])).unwrap();
    assert!(message(read_array(&path, NPY_KEY)).contains("declares shape (4,), 32 bytes; the file holds at most 24"));
    std::fs::write(&path, npy(&header("(2,)"), &[0; 24])).unwrap();
    assert!(message(read_array(&path, NPY_KEY)).contains("goes on after the declared shape is full"));
}

#[test]
fn a_checksum_that_does_not_match_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let data: Vec<f64> = (0..64).map(f64::from).collect();
    write(&path, &[("map", ArrayView::f64(&[8, 8], &data))]).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(8).position(|window| window == 33.0_f64.to_le_bytes()).unwrap();
    bytes[at] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let text = message(read_array(&path, "map"));
    assert!(text.contains("array `map` is damaged") && text.contains("checksum"), "{text}");
}

fn sample_pppr() -> Pppr {
    let mut pppr = Pppr::zeros(PpprShape { persons: 2, joints: 3, doppler_features: 5 });
    for (k, group) in Group::ALL.into_iter().enumerate() {
        for (i, value) in pppr.group_mut(group).iter_mut().enumerate() {
            *value = 100.0 * k as f64 + i as f64 + 0.1;
        }
    }
    pppr
}

#[test]
fn parameters_come_back_bit_for_bit_and_shapes_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.npz");
    let pppr = sample_pppr();
    write_pppr(&path, &pppr).unwrap();
    assert_eq!(read_pppr(&path, None).unwrap(), pppr);
    assert_eq!(read_pppr(&path, Some(pppr.shape())).unwrap(), pppr);
    let other = PpprShape { joints: 17, ..pppr.shape() };
    let text = message(read_pppr(&path, Some(other)));
    assert!(text.contains("array `position` has shape (2, 3, 3); expected (2, 17, 3)"), "{text}");

    let shape = pppr.shape();
    let mut arrays: Vec<(&str, Vec<usize>, Vec<f64>)> =
        Group::ALL.iter().map(|&g| (g.key(), shape.array_shape(g), pppr.group(g).to_vec())).collect();
    arrays[4] = ("beta", vec![2, 3, 1], arrays[4].2.clone());
    let views = |arrays: &[(&'static str, Vec<usize>, Vec<f64>)]| {
        let views: Vec<_> = arrays.iter().map(|(key, shape, data)| (*key, ArrayView::f64(shape, data))).collect();
        write(&path, &views).unwrap();
    };
    views(&arrays);
    assert!(message(read_pppr(&path, None)).contains("array `beta` has shape (2, 3, 1); expected (2, 3)"));
    arrays[4] = ("beta", vec![2, 3], arrays[4].2.clone());
    arrays[1].2[4] = f64::NAN;
    views(&arrays);
    assert!(message(read_pppr(&path, None)).contains("array `log_scale` is damaged: element 4 is NaN"));
    arrays.remove(3);
    views(&arrays);
    assert!(message(read_pppr(&path, None)).contains("no array `velocity`"), "headers come first");
    arrays[1].2[4] = 0.0;
    views(&arrays);
    assert!(message(read_pppr(&path, None)).contains("no array `velocity`"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever bytes are changed or cut off, reading gives arrays or an error, never a panic.
    #[test]
    fn damaged_files_never_panic(cut in 0.0..1.0_f64, edits in prop::collection::vec((0.0..1.0_f64, any::<u8>()), 0..6)) {
        let mut bytes = std::fs::read(numpy_file()).unwrap();
        for (place, value) in edits {
            let at = (place * bytes.len() as f64) as usize;
            bytes[at] = value;
        }
        if cut < 0.5 {
            bytes.truncate((2.0 * cut * bytes.len() as f64) as usize);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("damaged.npz");
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(mut file) = NpzArchive::open(&path) {
            for key in file.keys().to_vec() {
                let _ = (file.entry(&key), file.read(&key), file.read_texts(&key), file.read_slab(&key, 1));
            }
        }
    }

    /// The same for the header of an npy file, whose text is hostile rather than random.
    #[test]
    fn hostile_headers_never_panic(
        shape in "[(]([0-9]{1,22}, ?){0,4}[)]",
        descr in "'[<>|=][a-zA-Z][0-9]{0,20}(\\[[a-z]{1,3}\\])?'|\\[\\('a', '<f4', \\([0-9]{1,20},\\)\\)\\]",
        order in "True|False|1|None",
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hostile.npy");
        let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
        std::fs::write(&path, npy(&header, &[1; 96])).unwrap();
        let mut file = NpzArchive::open(&path).unwrap();
        let _ = (file.entry(NPY_KEY), file.read(NPY_KEY), file.read_texts(NPY_KEY), file.read_slab(NPY_KEY, 0));
    }
}
