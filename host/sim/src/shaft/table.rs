//! The points of a shaft from a file of comma-separated values.

use std::fs;
use std::path::PathBuf;

use super::motion::Point;
use super::{ShaftError, number};

/// Reads lines of seconds and turns in rising time. Blank lines and lines that begin with `#` are
/// skipped; a first line without a digit is a header.
///
/// Split by hand: what makes the format hard, quoted commas and line ends, has no place in two
/// columns of numbers, and the lines keep their numbers.
pub(super) fn read(path: PathBuf, singleturn_resolution: u32) -> Result<Vec<Point>, ShaftError> {
    let octets = match fs::read(&path) {
        Ok(octets) => octets,
        Err(error) => return Err(ShaftError::File { path, error }),
    };
    match points(&octets, singleturn_resolution) {
        Ok(points) if points.is_empty() => Err(ShaftError::Empty(path)),
        Ok(points) => Ok(points),
        Err((line, problem)) => Err(ShaftError::Line { path, line, problem }),
    }
}

/// The points, or the line and what is wrong with it.
fn points(octets: &[u8], singleturn_resolution: u32) -> Result<Vec<Point>, (usize, String)> {
    let text = str::from_utf8(octets).map_err(|error| {
        let before = octets.iter().take(error.valid_up_to());
        let line = 1 + before.filter(|&&octet| octet == b'\n').count();
        (line, "it is not UTF-8 text".to_owned())
    })?;
    // Spreadsheets like to begin with a byte order mark.
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).peekable();
    lines.next_if(|(_, line)| !line.bytes().any(|octet| octet.is_ascii_digit()));

    let mut points: Vec<Point> = Vec::new();
    for (number, line) in lines {
        let point = point(line, singleturn_resolution, points.last());
        points.push(point.map_err(|problem| (number, problem))?);
    }
    Ok(points)
}

fn point(line: &str, singleturn_resolution: u32, before: Option<&Point>) -> Result<Point, String> {
    let columns: Vec<&str> = line.split(',').map(unquoted).collect();
    let [seconds, turns] = columns.as_slice() else {
        return Err(format!("'{line}' is not two columns, seconds and turns"));
    };
    // The column names the unit: "5ms" would be a trap in a column of seconds.
    let at = number::decimal(seconds)
        .and_then(|_| number::time(seconds))
        .ok_or_else(|| format!("'{seconds}' is no time in seconds, a decimal from 0 on"))?;
    let angle = number::decimal(turns)
        .map(|turns| number::turns(turns, singleturn_resolution))
        .ok_or_else(|| format!("'{turns}' is no angle in turns, a decimal number"))?;
    if before.is_some_and(|before| before.at >= at) {
        return Err(format!("the time {seconds} does not come after the line before"));
    }
    Ok(Point { at, angle })
}

fn unquoted(column: &str) -> &str {
    let column = column.trim();
    column.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(column)
}
