//! POV-Ray's program.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::Antialiasing;
use crate::error::{Error, Place, Problem};
use crate::film::png_chunk::Transfer;
use crate::film::{Film, Samples, read_image};
use crate::measure::process::{Ended, run};
use crate::render::Control;

/// What it is called where it is installed.
const PROGRAM: &str = "povray";

/// The exported scene and the picture, in a folder that the program may use.
const SCENE: &str = "scene.pov";
const PICTURE: &str = "picture.png";

/// POV-Ray, found and ready.
#[derive(Clone, Debug)]
pub struct Program {
    path: PathBuf,
    /// As it names itself.
    pub version: String,
}

impl Program {
    /// Finds the program.
    ///
    /// # Errors
    /// When there is none, or it is not of version 3.7.
    pub fn find() -> Result<Program, Error> {
        Program::at(Path::new(PROGRAM))
    }

    /// Asks a program whether it is POV-Ray.
    ///
    /// # Errors
    /// As [`Program::find`].
    pub fn at(path: &Path) -> Result<Program, Error> {
        let answer = Command::new(path).arg("--version").stdin(Stdio::null()).output().map_err(|error| {
            let what = format!("POV-Ray cannot be started: {error}");
            Error::from(
                Problem::new(Place::file(path), what)
                    .expected("POV-Ray 3.7 in the PATH")
                    .help("on Debian and Ubuntu it is the package `povray`"),
            )
        })?;
        // It tells of its version on either stream, by build.
        let text = String::from_utf8_lossy(&[answer.stdout, answer.stderr].concat()).into_owned();
        let version = text.lines().find_map(|line| line.trim().strip_prefix("POV-Ray "));
        match version.filter(|version| version.starts_with("3.7")) {
            Some(version) => Ok(Program { path: path.to_owned(), version: version.to_owned() }),
            None => Err(Problem::new(Place::file(path), "not a POV-Ray that can be compared with")
                .found(version.unwrap_or("no version"))
                .expected("3.7")
                .into()),
        }
    }

    /// Renders an exported scene in a folder of its own, and says how long the process took. `white` is what the scene's radiance
    /// was divided by.
    ///
    /// # Errors
    /// A process that fails or is stopped, a picture that cannot be read.
    pub fn render(&self, job: &Job, antialiasing: &Antialiasing, control: &Control) -> Result<(Film, f64), Ended> {
        let Job { folder, size_px: [width, height], threads, white } = job;
        let mut command = Command::new(&self.path);
        command.current_dir(folder).args([format!("+I{SCENE}"), format!("+O{PICTURE}")]);
        // 16 bits, linear, nothing shown, nothing asked.
        command.args([&format!("+W{width}"), &format!("+H{height}"), &format!("+WT{threads}")]);
        command.args(["+FN16", "File_Gamma=1.0", "Dither=Off", "Quality=9", "-D", "-P", "-V"]);
        command.args(antialiasing.options());
        let seconds = run(&mut command, control)?;
        let mut film = read_image(folder.join(PICTURE), Some(Transfer::Linear))?.film;
        for plane in &mut film.planes {
            if let Samples::F32(values) = &mut plane.samples {
                values.iter_mut().for_each(|value| *value = (f64::from(*value) * white) as f32);
            }
        }
        Ok((film, seconds))
    }
}

/// What is rendered, and where.
#[derive(Clone, Debug)]
pub struct Job {
    /// A folder that holds [`write_scene`]'s file.
    pub folder: PathBuf,
    /// Width and height.
    pub size_px: [u32; 2],
    /// Threads.
    pub threads: usize,
    /// What radiance was divided by.
    pub white: f64,
}

/// Writes a scene where [`Program::render`] finds it.
///
/// # Errors
/// What the file system answers.
pub fn write_scene(folder: &Path, text: &str) -> Result<(), Error> {
    let path = folder.join(SCENE);
    std::fs::write(&path, text).map_err(|error| Error::io(&path, "write the scene", &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absent_program_and_another_one_are_told_apart() {
        let absent = Program::at(Path::new("/nowhere/povray")).unwrap_err().to_string();
        assert!(absent.contains("cannot be started") && absent.contains("POV-Ray 3.7"), "{absent}");
        if let Err(error) = Program::at(Path::new("true")) {
            assert!(error.to_string().contains("not a POV-Ray") || error.to_string().contains("cannot be started"));
        }
    }
}
