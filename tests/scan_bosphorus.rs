//! Bosphorus' files, whatever is in them: an answer or a refusal that names the file, never a panic.

use std::path::Path;

use proptest::prelude::*;
use understudy::scan::{LandmarkFormat, LandmarkScheme, MeshFormat, read_landmarks_bytes, read_mesh_bytes};

fn range_image(rows: u16, columns: u16, values: &[f64]) -> Vec<u8> {
    let points = usize::from(rows) * usize::from(columns);
    let mut bytes = [rows.to_le_bytes(), columns.to_le_bytes()].concat();
    bytes.extend((-1e9_f64).to_le_bytes());
    bytes.extend(0_u16.to_le_bytes());
    bytes.extend((5 * points as u32).to_le_bytes());
    bytes.extend(values.iter().cycle().take(5 * points).flat_map(|value| value.to_le_bytes()));
    bytes
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![6 => -100.0..100.0_f64, 1 => any::<f64>(), 1 => Just(-1e9)]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn range_images_are_read_or_refused(
        rows in 0..12_u16,
        columns in 0..12_u16,
        values in prop::collection::vec(number(), 1..700),
        cut in 0..2000_usize,
        broken in prop::option::of((0..24_usize, any::<u8>())),
    ) {
        let mut bytes = range_image(rows, columns, &values);
        if let Some((at, byte)) = broken
            && let Some(place) = bytes.get_mut(at)
        {
            *place = byte;
        }
        for length in [bytes.len(), bytes.len().min(cut)] {
            match read_mesh_bytes(&bytes[..length], MeshFormat::Bnt, Path::new("/nonexistent/face.bnt")) {
                Ok(mesh) => {
                    prop_assert!(mesh.validate().is_ok());
                    prop_assert_eq!(mesh.uvs.len(), mesh.positions.len());
                }
                Err(error) => prop_assert!(error.to_string().contains("face.bnt")),
            }
        }
    }

    #[test]
    fn landmark_files_are_read_or_refused(
        lines in prop::collection::vec(
            prop_oneof![
                Just("Nose tip".to_owned()),
                Just("Chin middle".to_owned()),
                Just("Outer left eye corner".to_owned()),
                Just("22 landmarks:".to_owned()),
                Just("# comment".to_owned()),
                Just(String::new()),
                Just("1 2 3".to_owned()),
                Just("nan inf 3".to_owned()),
                ".{0,20}",
            ],
            0..12,
        ),
        windows in any::<bool>(),
    ) {
        let text = lines.join(if windows { "\r\n" } else { "\n" });
        match read_landmarks_bytes(text.as_bytes(), LandmarkFormat::Lm3, Path::new("face.lm3")) {
            Ok(file) => prop_assert_eq!(file.scheme(), LandmarkScheme::Network478),
            Err(error) => prop_assert!(error.to_string().contains("face.lm3")),
        }
    }

    #[test]
    fn any_bytes_are_refused_in_words(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read_landmarks_bytes(&bytes, LandmarkFormat::Lm3, Path::new("face.lm3"));
        if let Err(error) = read_mesh_bytes(&bytes, MeshFormat::Bnt, Path::new("face.bnt")) {
            prop_assert!(error.to_string().contains("face.bnt"));
        }
    }
}
