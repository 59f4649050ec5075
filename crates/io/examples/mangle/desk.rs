//! Where files are mangled: a copy of each folder of the corpus, made once, so that what a file
//! names lies beside it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A folder for all copies, and for what is kept.
pub struct Desk {
    here: PathBuf,
    folders: HashMap<PathBuf, PathBuf>,
}

impl Desk {
    /// An empty one of that name, where the system has its temporary files.
    pub fn new(name: &str) -> Self {
        let here = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&here).expect("a folder for mangled files");
        Self {
            here,
            folders: HashMap::new(),
        }
    }

    /// Where it is.
    pub fn here(&self) -> &Path {
        &self.here
    }

    /// The copy of the folder that a file is in.
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

    /// Keeps a folder as it is, under a name.
    pub fn keep(&self, folder: &Path, name: &str) -> PathBuf {
        let kept = self.here.join(name);
        copy_files(folder, &kept);
        kept
    }

    /// Removes all but what was kept.
    pub fn clear(self) {
        self.folders
            .values()
            .for_each(|folder| drop(std::fs::remove_dir_all(folder)));
        // Only if nothing is in it.
        let _ = std::fs::remove_dir(self.here);
    }
}

fn copy_files(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder for files");
    for entry in std::fs::read_dir(from).into_iter().flatten().flatten() {
        if entry.path().is_file() && entry.metadata().is_ok_and(|data| data.len() < 1 << 22) {
            // Not its permissions: what is written over may be read-only.
            let _ = std::fs::read(entry.path())
                .map(|bytes| std::fs::write(to.join(entry.file_name()), bytes));
        }
    }
}
