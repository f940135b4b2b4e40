//! OBJ: a mesh as text, its materials in an MTL and its textures beside it.

use std::{
    collections::BTreeSet,
    fmt,
    io::Write as _,
    path::{Path, PathBuf},
};

use super::{Draft, ExportError};
use crate::scan::{Material, Mesh, Texture, TextureFormat};

const LEAVE_OUT: &str = "Repair the mesh first";

/// Writes `mesh` as an OBJ, in the frame and unit that it is in.
///
/// Every vertex is written, in its order, with its colour where the mesh has colours (`v x y z r g b`); numbers are the
/// shortest that read back as the same. Triangles keep their order. With materials an MTL is written beside the OBJ, and
/// the textures beside that under the OBJ's own stem ([`obj_files`] names them all); a mesh without materials needs
/// neither. Each file appears whole or not at all, the OBJ last.
pub fn write_obj(path: &Path, mesh: &Mesh) -> Result<(), ExportError> {
    let corners = |t: usize| {
        let uvs = mesh.uv_triangles.get(t);
        (0..3).map(move |k| (mesh.triangles[t][k], uvs.map(|uvs| uvs[k])))
    };
    write(path, mesh, mesh.triangles.len(), corners)
}

/// As [`write_obj`], with four-cornered faces in the place of the mesh's triangles.
///
/// `quads` are Q × 4 indices into the mesh's positions, counter-clockwise; its texture coordinates, if it has one for
/// every vertex, go by the same indices. All faces have the first material.
pub fn write_quad_obj(path: &Path, mesh: &Mesh, quads: &[[u32; 4]]) -> Result<(), ExportError> {
    let count = mesh.positions.len();
    if let Some(quad) = quads.iter().position(|quad| quad.iter().any(|&v| v as usize >= count)) {
        return Err(ExportError::refused(
            path,
            format!("face {quad} names a vertex beyond the {count} there are"),
            LEAVE_OUT,
        ));
    }
    let textured = mesh.uvs.len() == count;
    let corners = |f: usize| quads[f].into_iter().map(move |v| (v, textured.then_some(v)));
    let plain = Mesh { triangle_materials: Vec::new(), ..mesh.clone() };
    write(path, &plain, quads.len(), corners)
}

/// The files that [`write_obj`] makes of `mesh` at `path`: textures, MTL, and the OBJ itself at the end.
pub fn obj_files(path: &Path, mesh: &Mesh) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        textures(path, mesh).into_iter().map(|(file, _)| beside(path, &file)).collect();
    if !mesh.materials.is_empty() {
        files.push(beside(path, &format!("{}.mtl", stem(path))));
    }
    files.push(path.to_path_buf());
    files
}

/// Each different texture with the name of its file, in the order in which materials first name them.
fn textures<'a>(path: &Path, mesh: &'a Mesh) -> Vec<(String, &'a Texture)> {
    let mut found: Vec<(String, &Texture)> = Vec::new();
    for texture in mesh.materials.iter().filter_map(|material| material.texture.as_deref()) {
        if !found.iter().any(|(_, known)| *known == texture) {
            let number = if found.is_empty() { String::new() } else { format!("-{}", found.len() + 1) };
            let extension = match texture.format {
                TextureFormat::Png => "png",
                TextureFormat::Jpeg => "jpg",
            };
            found.push((format!("{}{number}.{extension}", stem(path)), texture));
        }
    }
    found
}

fn write<C: Iterator<Item = (u32, Option<u32>)>>(
    path: &Path,
    mesh: &Mesh,
    faces: usize,
    corners: impl Fn(usize) -> C,
) -> Result<(), ExportError> {
    mesh.validate().map_err(|fault| ExportError::refused(path, fault.to_string(), LEAVE_OUT))?;
    let names = material_names(&mesh.materials);
    let textures = textures(path, mesh);
    let mut drafts = Vec::new();
    for (file, texture) in &textures {
        let mut draft = Draft::create(&beside(path, file))?;
        draft.append(&texture.bytes)?;
        drafts.push(draft);
    }
    if !mesh.materials.is_empty() {
        let mut draft = Draft::create(&beside(path, &format!("{}.mtl", stem(path))))?;
        for (material, name) in mesh.materials.iter().zip(&names) {
            let [r, g, b, _] = material.base_colour;
            line(&mut draft, format_args!("newmtl {name}"))?;
            line(&mut draft, format_args!("Kd {r} {g} {b}"))?;
            let texture = material.texture.as_deref();
            if let Some((file, _)) = textures.iter().find(|(_, known)| Some(*known) == texture) {
                line(&mut draft, format_args!("map_Kd {file}"))?;
            }
        }
        drafts.push(draft);
    }

    let mut draft = Draft::create(path)?;
    if !names.is_empty() {
        line(&mut draft, format_args!("mtllib {}.mtl", stem(path)))?;
    }
    for (v, p) in mesh.positions.iter().enumerate() {
        match mesh.colours.get(v) {
            Some([r, g, b]) => line(&mut draft, format_args!("v {} {} {} {r} {g} {b}", p.x, p.y, p.z))?,
            None => line(&mut draft, format_args!("v {} {} {}", p.x, p.y, p.z))?,
        }
    }
    for [u, v] in &mesh.uvs {
        line(&mut draft, format_args!("vt {u} {v}"))?;
    }
    let mut current = None;
    for f in 0..faces {
        let material = mesh.triangle_materials.get(f).copied().unwrap_or(0) as usize;
        if current != Some(material)
            && let Some(name) = names.get(material)
        {
            line(&mut draft, format_args!("usemtl {name}"))?;
            current = Some(material);
        }
        draft.append(b"f")?;
        for (vertex, uv) in corners(f) {
            let corner = match uv {
                Some(uv) => format!(" {}/{}", u64::from(vertex) + 1, u64::from(uv) + 1),
                None => format!(" {}", u64::from(vertex) + 1),
            };
            draft.append(corner.as_bytes())?;
        }
        draft.append(b"\n")?;
    }
    for finished in drafts {
        finished.commit()?;
    }
    draft.commit()
}

fn line(draft: &mut Draft, words: fmt::Arguments) -> Result<(), ExportError> {
    let written = writeln!(draft.writer(), "{words}");
    written.map_err(|source| ExportError::write(draft.destination(), source))
}

/// One word for each material, no two alike.
fn material_names(materials: &[Material]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let named = |material: &Material| {
        let word = word(&material.name);
        let mut name = if word.is_empty() { "material".to_owned() } else { word };
        while !taken.insert(name.clone()) {
            name.push('_');
        }
        name
    };
    materials.iter().map(named).collect()
}

/// The stem of the files beside the OBJ, without what programs stumble over in a material file.
fn stem(path: &Path) -> String {
    word(&path.file_stem().map_or_else(|| "mesh".into(), |stem| stem.to_string_lossy()))
}

/// Blanks and the signs that begin comments, options and folders become low lines.
fn word(text: &str) -> String {
    let plain = |c: char| if c.is_whitespace() || c.is_control() || "#\"\\/".contains(c) { '_' } else { c };
    let word: String = text.trim().chars().map(plain).collect();
    word.strip_prefix('-').map_or_else(|| word.clone(), |rest| format!("_{rest}"))
}

fn beside(path: &Path, file: &str) -> PathBuf {
    path.with_file_name(file)
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::Arc};

    use nalgebra::Point3;

    use super::*;
    use crate::scan::read_mesh;

    fn picture(grey: u8) -> Arc<Texture> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbImage::from_pixel(2, 2, image::Rgb([grey; 3]))
            .write_to(&mut bytes, image::ImageFormat::Png)
            .unwrap();
        Arc::new(Texture { name: "skin.png".into(), format: TextureFormat::Png, bytes: bytes.into_inner() })
    }

    fn sheet() -> Mesh {
        let corner = |x: f64, y: f64| Point3::new(0.1 * x - 1e-7, y / 3.0, -123.456 * x * y);
        Mesh {
            positions: [(0, 0), (1, 0), (1, 1), (0, 1), (5, 5)]
                .map(|(x, y)| corner(f64::from(x), f64::from(y)))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_plain_mesh_is_one_file_and_comes_back_bit_by_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.obj");
        let mesh = sheet();
        write_obj(&path, &mesh).unwrap();
        assert_eq!(read_mesh(&path).unwrap(), mesh);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_eq!(obj_files(&path, &mesh), [path]);
    }

    #[test]
    fn colours_textures_and_materials_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my sheet.obj");
        let material = |name: &str, texture: Option<Arc<Texture>>| Material {
            name: name.into(),
            base_colour: [1.0; 4],
            texture,
            gloss: 0.0,
        };
        let mesh = Mesh {
            uvs: vec![[0.0, 0.1], [1.0, 0.0], [0.3, 1.0]],
            uv_triangles: vec![[0, 1, 2], [0, 2, 1]],
            colours: vec![[0.1, 0.2, 0.3], [1.0; 3], [0.0; 3], [0.5; 3], [0.25; 3]],
            materials: vec![
                material("left side", Some(picture(9))),
                material("left side", Some(picture(200))),
                material("", Some(picture(9))),
            ],
            triangle_materials: vec![1, 0],
            ..sheet()
        };
        write_obj(&path, &mesh).unwrap();
        let files = obj_files(&path, &mesh);
        let names: Vec<_> = files.iter().map(|f| f.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["my_sheet.png", "my_sheet-2.png", "my_sheet.mtl", "my sheet.obj"]);
        assert!(files.iter().all(|file| file.is_file()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
        let read = read_mesh(&path).unwrap();
        assert_eq!((&read.positions, &read.triangles), (&mesh.positions, &mesh.triangles));
        assert_eq!((&read.uvs, &read.uv_triangles), (&mesh.uvs, &mesh.uv_triangles));
        assert_eq!(read.colours, mesh.colours);
        let texture_of = |mesh: &Mesh, t: usize| {
            mesh.materials[mesh.triangle_materials[t] as usize].texture.clone().unwrap().bytes.clone()
        };
        assert!((0..2).all(|t| texture_of(&read, t) == texture_of(&mesh, t)));
    }

    #[test]
    fn quads_are_faces_of_four_corners() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("quads.obj");
        let mesh = Mesh { uvs: vec![[0.0; 2]; 5], ..sheet() };
        write_quad_obj(&path, &mesh, &[[0, 1, 2, 3]]).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("\nf 1/1 2/2 3/3 4/4\n"), "{text}");
        let read = read_mesh(&path).unwrap();
        assert_eq!((read.positions, read.triangles), (mesh.positions.clone(), mesh.triangles.clone()));
        let error = write_quad_obj(&path, &mesh, &[[0, 1, 2, 9]]).unwrap_err().to_string();
        assert!(error.contains("quads.obj") && error.contains("face 0"), "{error}");
    }

    #[test]
    fn what_cannot_be_written_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.obj");
        fs::write(&path, "old").unwrap();
        let mut broken = sheet();
        broken.positions[1].x = f64::NAN;
        let error = write_obj(&path, &broken).unwrap_err().to_string();
        assert!(error.contains("sheet.obj") && error.contains("vertex 1"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert!(write_obj(&folder.path().join("none/sheet.obj"), &sheet()).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
