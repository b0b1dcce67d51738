//! Results on disk, whole or not at all: written beside their place and renamed when complete; a signal on the way removes
//! them.
//!
//! A file is replaced. A folder is made if need be; files of the same names in it are replaced and all
//! others are kept.

use std::{
    fmt,
    fs::{self, Permissions},
    io::{self, BufWriter, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use tempfile::{Builder, TempDir};

use crate::{exit::Failure, interrupt::Unfinished};

/// How what is not finished is called; whoever finds it after a power loss may delete it.
pub const UNFINISHED: &str = ".actuary-unfinished-";

/// Where one file will be.
#[derive(Debug)]
pub struct OutputFile {
    file: PathBuf,
}

impl OutputFile {
    /// Checks that a file can be written there, so that nobody waits for a result that has no place.
    pub fn new(file: &Path) -> Result<Self, Failure> {
        let refuse = |reason: &dyn fmt::Display| Failure::BadInput(format!("{}: {reason}", file.display()));
        if file.is_dir() {
            return Err(refuse(&"is a folder, not a file"));
        }
        // Through a symbolic link, so that the link stays.
        let file = fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
        if is_stream(&file) {
            return Ok(Self { file });
        }
        let folder = folder_of(&file);
        tempfile::tempfile_in(folder).map_err(|error| refuse(&format!("cannot be written: {}", bare(&error))))?;
        Ok(Self { file })
    }

    /// Writes the file and puts it in its place.
    pub fn write(&self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        self.try_write(content).with_context(|| format!("cannot write {}", self.file.display()))
    }

    fn try_write(&self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        if is_stream(&self.file) {
            let mut stream = BufWriter::new(fs::File::options().write(true).open(&self.file)?);
            content(&mut stream)?;
            return stream.flush();
        }
        let permissions = Permissions::from_mode(0o666);
        let make = || Builder::new().prefix(UNFINISHED).permissions(permissions).tempfile_in(folder_of(&self.file));
        let beside = Unfinished::new(make)?;
        let mut writer = BufWriter::new(beside.made().as_file());
        content(&mut writer)?;
        writer.flush()?;
        drop(writer);
        beside.made().as_file().sync_all()?;
        beside.finish(|beside| beside.persist(&self.file))?;
        Ok(())
    }
}

/// Where the files of a folder will be.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
}

impl OutputFolder {
    /// Checks that a folder can be written there.
    pub fn new(folder: &Path) -> Result<Self, Failure> {
        let refuse = |reason: &dyn fmt::Display| Failure::BadInput(format!("{}: {reason}", folder.display()));
        let existing = folder.ancestors().find(|ancestor| ancestor.exists()).unwrap_or(Path::new("."));
        if !existing.is_dir() {
            return Err(refuse(&format!("{} is a file, not a folder", existing.display())));
        }
        tempfile::tempfile_in(existing).map_err(|error| refuse(&format!("cannot be written: {}", bare(&error))))?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes files and puts them in their place once all are complete. Parents of the folder are made.
    pub fn write(&self, content: impl FnOnce(&Draft) -> io::Result<()>) -> Result<()> {
        self.try_write(content).with_context(|| format!("cannot write {}", self.folder.display()))
    }

    fn try_write(&self, content: impl FnOnce(&Draft) -> io::Result<()>) -> io::Result<()> {
        // Inside the folder where there is one, since it may be a mount of its own.
        let place = if self.folder.is_dir() { self.folder.as_path() } else { folder_of(&self.folder) };
        fs::create_dir_all(place)?;
        let permissions = Permissions::from_mode(0o777);
        let make = || Builder::new().prefix(UNFINISHED).permissions(permissions).tempdir_in(place);
        let draft = Draft(Unfinished::new(make)?);
        content(&draft)?;
        draft.0.finish(|draft| self.put(draft))
    }

    fn put(&self, draft: TempDir) -> io::Result<()> {
        if !self.folder.exists() {
            // The draft takes the place, so there is none left to remove.
            return fs::rename(draft.keep(), &self.folder);
        }
        for entry in fs::read_dir(draft.path())? {
            let entry = entry?;
            fs::rename(entry.path(), self.folder.join(entry.file_name()))?;
        }
        Ok(())
    }
}

/// A folder that is being written; dropped, it leaves nothing behind.
#[derive(Debug)]
pub struct Draft(Unfinished<TempDir>);

impl Draft {
    /// Writes a file of the folder.
    pub fn file(&self, name: &str, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let mut writer = BufWriter::new(fs::File::create(self.0.path().join(name))?);
        content(&mut writer)?;
        writer.flush()
    }
}

/// Pipes and devices are written to: nothing can take their place.
fn is_stream(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|found| !found.is_file())
}

/// The folder that a file or folder is in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The error without the path of a temporary file, which means nothing to a user.
fn bare(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "its folder does not exist".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        kind => kind.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failing_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("k.csv");
        let output = OutputFile::new(&file).unwrap();
        output.write(|writer| writer.write_all(b"old")).unwrap();
        let failed = output.write(|writer| {
            writer.write_all(b"ne")?;
            Err(io::Error::other("disk"))
        });
        assert!(failed.is_err());
        assert_eq!((fs::read(&file).unwrap(), names(folder.path())), (b"old".to_vec(), vec!["k.csv".to_owned()]));
        output.write(|writer| writer.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }

    #[test]
    fn a_place_that_cannot_be_written_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(OutputFile::new(folder.path()).unwrap_err().to_string().ends_with("is a folder, not a file"));
        let orphan = OutputFile::new(&folder.path().join("none/k.csv")).unwrap_err().to_string();
        assert!(orphan.ends_with("none/k.csv: cannot be written: its folder does not exist"), "{orphan}");
        assert!(
            OutputFolder::new(&file.join("out")).unwrap_err().to_string().ends_with("file is a file, not a folder")
        );
        assert!(OutputFolder::new(&file).unwrap_err().to_string().ends_with("is a file, not a folder"));
    }

    #[test]
    fn a_link_and_a_device_stay_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        OutputFile::new(&link).unwrap().write(|writer| writer.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        OutputFile::new(Path::new("/dev/null")).unwrap().write(|writer| writer.write_all(b"gone")).unwrap();
        assert!(is_stream(Path::new("/dev/null")));
    }

    #[test]
    fn a_folder_appears_whole_or_not_at_all() {
        let root = tempfile::tempdir().unwrap();
        let output = OutputFolder::new(&root.path().join("deep/out")).unwrap();
        let failed = output.write(|draft| {
            draft.file("K.csv", |writer| writer.write_all(b"k1"))?;
            Err(io::Error::other("disk"))
        });
        assert!(failed.is_err());
        assert_eq!(names(&root.path().join("deep")), Vec::<String>::new());
        output.write(|draft| draft.file("K.csv", |writer| writer.write_all(b"k1"))).unwrap();
        assert_eq!(names(&root.path().join("deep")), ["out"]);
        assert_eq!(names(&root.path().join("deep/out")), ["K.csv"]);
    }

    #[test]
    fn a_folder_keeps_its_other_files() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        fs::write(folder.path().join("K.csv"), "old").unwrap();
        let output = OutputFolder::new(folder.path()).unwrap();
        output.write(|draft| draft.file("K.csv", |writer| writer.write_all(b"new"))).unwrap();
        assert_eq!(names(folder.path()), ["K.csv", "notes.txt"]);
        assert_eq!(fs::read(folder.path().join("K.csv")).unwrap(), b"new");
    }
}
