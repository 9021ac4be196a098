//! A shaft from its line of text.

use std::io;
use std::path::{Path, PathBuf};

use codewheel_station::{Duration, Instant};

use super::motion::{Motion, Point, Profile};
use super::{PARTS, Shaft, number, table};

/// The fastest turn taken, in revolutions per minute, either way.
const FASTEST: i128 = 1_000_000 * number::ONE;

/// The shortest profile that can be repeated; rounds are counted and must not be too many.
const SHORTEST_ROUND: Duration = Duration::from_millis(1);

/// Why a text is no shaft.
#[derive(Debug, thiserror::Error)]
pub enum ShaftError {
    /// The first word is none of the shafts.
    #[error(
        "shaft '{0}' makes no sense: it is one of still, turn rpm=R, sine amplitude=A period=T, \
         profile T:A T:A …, csv FILE"
    )]
    Unknown(String),
    /// A word that this shaft does not know.
    #[error("'{word}' means nothing to shaft '{shaft}', which takes {allowed}")]
    Word {
        /// The word.
        word: String,
        /// The first word of the shaft.
        shaft: &'static str,
        /// What it takes.
        allowed: &'static str,
    },
    /// A word that stands there twice.
    #[error("'{0}=' stands twice in the shaft: once is enough")]
    Twice(&'static str),
    /// Something this shaft needs is not there.
    #[error("shaft '{shaft}' lacks {missing}")]
    Missing {
        /// The first word of the shaft.
        shaft: &'static str,
        /// What it lacks.
        missing: &'static str,
    },
    /// A value out of its range or no value at all.
    #[error("'{given}' is no {what}: it is {allowed}")]
    Value {
        /// What was given.
        given: String,
        /// What it should be, by name.
        what: &'static str,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Points whose times do not rise.
    #[error("the times of a shaft rise from point to point, but '{0}' does not come after '{1}'")]
    Order(String, String),
    /// A repeated profile that is over at once.
    #[error("a repeated profile lasts 1 ms at least, but its last point is '{0}'")]
    Round(String),
    /// A code disc without codes, or with too many.
    #[error(
        "a code disc of {singleturn_resolution} steps per turn and {revolutions} turns makes no \
         sense: their product is 1 to 4294967295"
    )]
    Geometry {
        /// Steps per turn.
        singleturn_resolution: u32,
        /// Turns told apart.
        revolutions: u32,
    },
    /// A file that cannot be read.
    #[error("cannot read the shaft file {}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why not.
        #[source]
        error: io::Error,
    },
    /// A line of a file that is no point.
    #[error("line {line} of the shaft file {}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A file without a single point.
    #[error("the shaft file {} has no line with seconds and turns", .0.display())]
    Empty(PathBuf),
}

pub(super) fn parse(
    text: &str,
    singleturn_resolution: u32,
    revolutions: u32,
) -> Result<Shaft, ShaftError> {
    let codes = singleturn_resolution
        .checked_mul(revolutions)
        .filter(|&codes| codes > 0)
        .ok_or(ShaftError::Geometry { singleturn_resolution, revolutions })?;
    let text = text.trim();
    let (shaft, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let disc = Disc { singleturn_resolution, codes };
    let (motion, start) = match shaft {
        "still" => disc.still(rest)?,
        "turn" => disc.turn(rest)?,
        "sine" => disc.sine(rest)?,
        "profile" => disc.profile(rest)?,
        "csv" => disc.csv(rest)?,
        _ => return Err(ShaftError::Unknown(text.to_owned())),
    };
    Ok(Shaft { codes, start, begins: Instant::ZERO, motion })
}

#[derive(Clone, Copy)]
struct Disc {
    singleturn_resolution: u32,
    codes: u32,
}

/// A motion and the angle it starts from.
type Parsed = Result<(Motion, i128), ShaftError>;

impl Disc {
    fn still(self, rest: &str) -> Parsed {
        let [angle] = words(rest, "still", "angle=A", ["angle"])?;
        Ok((Motion::Still, self.start(angle)?))
    }

    fn turn(self, rest: &str) -> Parsed {
        let [rpm, angle] = words(rest, "turn", "rpm=R angle=A", ["rpm", "angle"])?;
        let rpm = rpm.ok_or(ShaftError::Missing { shaft: "turn", missing: "rpm=R" })?;
        let turns =
            number::decimal(rpm).filter(|turns| turns.abs() <= FASTEST).ok_or_else(|| {
                value(rpm, "speed", "from -1000000 to 1000000 revolutions per minute")
            })?;
        let motion = match number::turns(turns, self.singleturn_resolution) {
            0 => Motion::Still,
            angle => Motion::Turn { angle },
        };
        Ok((motion, self.start(angle)?))
    }

    fn sine(self, rest: &str) -> Parsed {
        let keys = ["amplitude", "period", "angle"];
        let [amplitude, period, angle] = words(rest, "sine", "amplitude=A period=T angle=A", keys)?;
        let missing = |missing| ShaftError::Missing { shaft: "sine", missing };
        let amplitude = self.angle(amplitude.ok_or(missing("amplitude=A"))?, "amplitude")?;
        let period = period.ok_or(missing("period=T"))?;
        let period = number::time(period)
            .filter(|&period| period > Duration::ZERO)
            .ok_or_else(|| value(period, "period", "a time above zero, in s or ms"))?;
        let motion = match amplitude {
            0 => Motion::Still,
            amplitude => Motion::Sine { amplitude, period },
        };
        Ok((motion, self.start(angle)?))
    }

    fn profile(self, rest: &str) -> Parsed {
        let mut points = Vec::new();
        let mut repeat = false;
        let mut start = None;
        let mut last = "";
        for word in rest.split_whitespace() {
            if word == "repeat" {
                repeat = true;
            } else if let Some(text) = word.strip_prefix("angle=") {
                if start.replace(text).is_some() {
                    return Err(ShaftError::Twice("angle"));
                }
            } else if let Some((at, angle)) = word.split_once(':') {
                let at = number::time(at).ok_or_else(|| value(at, "time", number::A_TIME))?;
                let angle = self.angle(angle, "angle")?;
                if points.last().is_some_and(|before: &Point| before.at >= at) {
                    return Err(ShaftError::Order(word.to_owned(), last.to_owned()));
                }
                points.push(Point { at, angle });
                last = word;
            } else {
                let allowed = "points T:A as in 1.5s:90deg, repeat and angle=A";
                return Err(ShaftError::Word { word: word.to_owned(), shaft: "profile", allowed });
            }
        }
        let Some(end) = points.last() else {
            let missing = "points T:A as in 0s:0 1.5s:90deg";
            return Err(ShaftError::Missing { shaft: "profile", missing });
        };
        let profile = if !repeat {
            Profile::once(points)
        } else if end.at < SHORTEST_ROUND {
            return Err(ShaftError::Round(last.to_owned()));
        } else {
            Profile::repeated(points, i128::from(self.codes) * PARTS)
        };
        Ok((Motion::Profile(profile), self.start(start)?))
    }

    fn csv(self, rest: &str) -> Parsed {
        let (path, angle) = file_and_angle(rest);
        if path.is_empty() {
            return Err(ShaftError::Missing { shaft: "csv", missing: "the name of its FILE" });
        }
        let points = table::read(path.into(), self.singleturn_resolution)?;
        Ok((Motion::Profile(Profile::once(points)), self.start(angle)?))
    }

    fn start(self, angle: Option<&str>) -> Result<i128, ShaftError> {
        angle.map_or(Ok(0), |text| self.angle(text, "angle"))
    }

    fn angle(self, text: &str, what: &'static str) -> Result<i128, ShaftError> {
        number::angle(text, self.singleturn_resolution)
            .ok_or_else(|| value(text, what, number::AN_ANGLE))
    }
}

/// The file is everything up to `angle=`, which stands last: a path may contain blanks.
fn file_and_angle(rest: &str) -> (&str, Option<&str>) {
    let (path, angle) = match rest.rsplit_once("angle=") {
        Some((path, angle)) if path.is_empty() || path.ends_with(char::is_whitespace) => {
            (path, Some(angle))
        }
        _ => (rest, None),
    };
    (path.trim(), angle)
}

pub(super) fn in_folder(text: &str, folder: &Path) -> String {
    let text = text.trim();
    let Some(("csv", rest)) = text.split_once(char::is_whitespace) else {
        return text.to_owned();
    };
    let (path, angle) = file_and_angle(rest);
    if path.is_empty() {
        return text.to_owned();
    }
    let angle = angle.map_or(String::new(), |angle| format!(" angle={angle}"));
    format!("csv {}{angle}", folder.join(path).display())
}

/// The values of `keys` in `text`, words of the form key=value.
fn words<'a, const N: usize>(
    text: &'a str,
    shaft: &'static str,
    allowed: &'static str,
    keys: [&'static str; N],
) -> Result<[Option<&'a str>; N], ShaftError> {
    let mut values = [None; N];
    for word in text.split_whitespace() {
        let known = word.split_once('=').and_then(|(key, value)| {
            let place = keys.iter().position(|&known| known == key)?;
            Some((place, value))
        });
        let Some((place, value)) = known else {
            return Err(ShaftError::Word { word: word.to_owned(), shaft, allowed });
        };
        if values[place].replace(value).is_some() {
            return Err(ShaftError::Twice(keys[place]));
        }
    }
    Ok(values)
}

fn value(given: &str, what: &'static str, allowed: &'static str) -> ShaftError {
    ShaftError::Value { given: given.to_owned(), what, allowed }
}
