//! The files that a model names, gathered beside it.

use std::collections::BTreeMap;

use super::model_files::{END, MAX_FILES, archived, is_tar, too_large};
use super::{MAX_MODEL_BYTES, ModelFiles, gltf, obj};
use crate::ImportError;
use crate::error::shown;

/// Finds a file beside a model by its relative path, with `/` between folders, if it is there. The
/// second argument is the most bytes that it may have.
pub type FindFile<'a> = &'a mut dyn FnMut(&str, u64) -> Result<Option<Vec<u8>>, ImportError>;

impl ModelFiles {
    /// The files of a model whose own file has this name, which is a glTF, a GLB or an OBJ file,
    /// or an archive of [`Self::to_tar`], for which nothing is looked for.
    ///
    /// The names that `find` is asked for come from the file, and may be any text: whoever answers
    /// must not leave the file's folder.
    ///
    /// # Errors
    /// If the file is malformed, a file that it names is missing, or there are more than
    /// [`MAX_MODEL_BYTES`] altogether.
    pub fn gather(name: &str, bytes: Vec<u8>, find: FindFile<'_>) -> Result<Self, ImportError> {
        if is_tar(&bytes) {
            return Self::from_tar(&bytes);
        }
        let mut files = Self {
            name: name.to_owned(),
            bytes,
            beside: BTreeMap::new(),
        };
        let own = archived(files.bytes.len()) + END;
        let mut left = MAX_MODEL_BYTES.checked_sub(own).ok_or_else(too_large)?;
        let mut add = |files: &mut Self, name: &str, is_needed: bool| {
            if files.beside.len() == MAX_FILES {
                let reason = format!("names more than {MAX_FILES} other files");
                return Err(ImportError::file(reason));
            }
            match find(name, left)? {
                Some(found) => {
                    let size = archived(found.len());
                    left = left.checked_sub(size).ok_or_else(too_large)?;
                    files.beside.insert(name.to_owned(), found);
                    Ok(())
                }
                None if !is_needed => Ok(()),
                None => Err(ImportError::file(format!(
                    "names the file {}, which is not beside it",
                    shown(name)
                ))),
            }
        };
        add(&mut files, &format!("{name}.toml"), false)?;
        // Materials of an OBJ file name pictures in turn.
        loop {
            let mut missing = files.names()?;
            missing.retain(|name| !files.beside.contains_key(name));
            if missing.is_empty() {
                return Ok(files);
            }
            for name in missing {
                if !files.beside.contains_key(&name) {
                    add(&mut files, &name, true)?;
                }
            }
        }
    }

    /// The names of the files that are needed, as far as they are known.
    fn names(&self) -> Result<Vec<String>, ImportError> {
        if self.is_obj() {
            obj::names(self)
        } else {
            gltf::names(&self.bytes)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn archives_keep_all_files() {
        let obj = b"mtllib tree.mtl\nv 0 0 0\n".to_vec();
        let mut asked = Vec::new();
        let files = ModelFiles::gather("tree.obj", obj, &mut |name, _| {
            asked.push(name.to_owned());
            Ok(match name {
                "tree.mtl" => Some(b"newmtl bark\nmap_Kd textures/bark.png\n".to_vec()),
                "textures/bark.png" => Some(vec![7; 513]),
                _ => None,
            })
        })
        .expect("all files are there");
        assert_eq!(asked, ["tree.obj.toml", "tree.mtl", "textures/bark.png"]);
        let archive = files.to_tar().expect("short names");
        let again = ModelFiles::gather("x.tar", archive.clone(), &mut |_, _| {
            panic!("an archive is whole")
        });
        assert_eq!(again, Ok(files));
        let mut damaged = archive;
        damaged[3] ^= 1;
        let refused = ModelFiles::gather("x.tar", damaged, &mut |_, _| Ok(None));
        assert!(refused.expect_err("sum").to_string().contains("damaged"));
    }

    #[test]
    fn what_is_missing_is_named() {
        let gltf = br#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":"a%20b.bin"}]}"#;
        let refused = ModelFiles::gather("x.gltf", gltf.to_vec(), &mut |_, _| Ok(None));
        let message = refused.expect_err("missing").to_string();
        assert!(
            message.contains("a b.bin, which is not beside"),
            "{message}"
        );
    }
}
