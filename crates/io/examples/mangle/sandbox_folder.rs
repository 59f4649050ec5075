//! Working folders: a copy of each folder of the corpus, made once, so that a mangled file lies
//! beside the files that it names.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Parent folder of all copies and kept folders.
pub struct MangleFolder {
    here: PathBuf,
    folders: HashMap<PathBuf, PathBuf>,
}

impl MangleFolder {
    /// Creates an empty folder with this name among the system's temporary files.
    pub fn new(name: &str) -> Self {
        let here = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&here).expect("a folder for mangled files");
        Self {
            here,
            folders: HashMap::new(),
        }
    }

    /// Path of the folder.
    pub fn here(&self) -> &Path {
        &self.here
    }

    /// Returns the copy of a file's folder, made on first use.
    pub fn folder(&mut self, file: &Path) -> PathBuf {
        let from = file.parent().unwrap_or(Path::new(".")).to_owned();
        let next = self.here.join(format!("files-{}", self.folders.len()));
        let copy = |from: &PathBuf| {
            copy_files(from, &next);
            next.clone()
        };
        match self.folders.get(&from) {
            Some(folder) => folder.clone(),
            None => self.folders.entry(from).or_insert_with_key(copy).clone(),
        }
    }

    /// Keeps a copy of a folder under a name.
    pub fn keep(&self, folder: &Path, name: &str) -> PathBuf {
        let kept = self.here.join(name);
        copy_files(folder, &kept);
        kept
    }

    /// Removes everything except the kept folders.
    pub fn clear(self) {
        self.folders
            .values()
            .for_each(|folder| drop(std::fs::remove_dir_all(folder)));
        // Succeeds only for an empty folder.
        let _ = std::fs::remove_dir(self.here);
    }
}

fn copy_files(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder for files");
    for entry in std::fs::read_dir(from).into_iter().flatten().flatten() {
        if entry.path().is_file() && entry.metadata().is_ok_and(|data| data.len() < 1 << 22) {
            // Permissions are not copied: the originals may be read-only.
            let _ = std::fs::read(entry.path())
                .map(|bytes| std::fs::write(to.join(entry.file_name()), bytes));
        }
    }
}
