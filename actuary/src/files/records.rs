//! Recorded lives of units whose limits say what failure is: a table, and what its user says of the columns.
//!
//! A unit fails when a value first passes its limit, linear between two rows. What contradicts itself is refused; what follows from
//! the rules and may surprise is noted. Lives that are judged tell nothing of what is nominal or where a limit lies.

mod file;
mod flags;
mod life;
mod measure;
mod notes;

use std::path::{Path, PathBuf};

use evaluation::{RecordedLife, Records};

use numerics::quantile;

use self::{
    file::{RecordFile, Row},
    life::Untold,
    measure::Told,
    notes::Notes,
};
use super::stress::{self, StressColumn};
use crate::exit::Failure;

pub use self::{flags::Flags, measure::Measure};

/// Lives that teach, and lives that are judged.
#[derive(Debug)]
pub struct Lives {
    /// Those that teach: over, and failed at least once.
    pub teach: Records,
    /// Those that are judged.
    pub judge: Records,
    /// What the values of each fault mean.
    pub measures: Vec<Measure>,
    /// What follows from the rules and may surprise, a line each.
    pub notes: Vec<String>,
}

/// Lives of which all teach.
#[derive(Debug)]
pub struct Teachers {
    /// The lives: over, and failed at least once.
    pub lives: Records,
    /// What the values of each fault mean.
    pub measures: Vec<Measure>,
    /// What follows from the rules and may surprise, a line each.
    pub notes: Vec<String>,
}

/// The tables of a backtest.
#[derive(Debug, Clone, Copy)]
pub struct Tables<'a> {
    /// Lives to judge; without a prior some of them teach.
    pub histories: &'a [PathBuf],
    /// Lives that teach.
    pub prior: Option<&'a Path>,
    /// The number of units that teach, without a prior; none for every second, from the first on.
    pub split: Option<usize>,
    /// Which columns tell load and temperature.
    pub stress: &'a stress::Flags,
}

/// Reads lives that teach and lives that are judged.
pub fn read(tables: Tables, flags: &Flags) -> Result<Lives, Failure> {
    let histories = read_histories(tables.histories, flags, tables.stress)?;
    let prior = tables.prior.map(|file| RecordFile::read(file, flags, tables.stress)).transpose()?;
    must_count_alike(prior.iter().chain(&histories))?;
    let all = units(&histories);
    let (teachers, judged) = match &prior {
        Some(prior) => (units(std::slice::from_ref(prior)), all),
        None => divided(all, tables.split)?,
    };
    let measures = Measure::all(flags, &teachers)?;
    let mut notes = Notes::new(prior.iter().chain(&histories), &measures);
    if prior.is_none() {
        notes.split(teachers.len(), judged.len(), tables.split.is_none());
    }
    judged
        .iter()
        .filter(|(_, unit)| teachers.iter().any(|(_, other)| unit.is_told_as(other)))
        .for_each(|(_, unit)| notes.taught(unit));
    let time_unit = &histories[0].time_unit;
    let reading = Reading { flags, measures: &measures, time_unit, stress: Stress::of(tables.stress, &teachers) };
    let teach = reading.teachers(&teachers, &mut notes)?;
    let judge = reading.lives(&judged, Untold::GoesOn, &mut notes)?;
    if judge.lives.is_empty() {
        return Err(judged[0]
            .0
            .refuse_whole("every unit is beyond a limit in its first row: there is nothing to predict"));
    }
    Ok(Lives { teach, judge, notes: notes.lines(), measures })
}

/// Reads lives that all teach.
pub fn read_teachers(histories: &[PathBuf], flags: &Flags, stress: &stress::Flags) -> Result<Teachers, Failure> {
    let histories = read_histories(histories, flags, stress)?;
    must_count_alike(histories.iter())?;
    let teachers = units(&histories);
    let measures = Measure::all(flags, &teachers)?;
    let mut notes = Notes::new(histories.iter(), &measures);
    let time_unit = &histories[0].time_unit;
    let reading = Reading { flags, measures: &measures, time_unit, stress: Stress::of(stress, &teachers) };
    let lives = reading.teachers(&teachers, &mut notes)?;
    Ok(Teachers { lives, notes: notes.lines(), measures })
}

fn read_histories(files: &[PathBuf], flags: &Flags, stress: &stress::Flags) -> Result<Vec<RecordFile>, Failure> {
    if let Some(contradiction) = flags.contradiction() {
        return Err(Failure::BadInput(contradiction));
    }
    let mut histories =
        files.iter().map(|file| RecordFile::read(file, flags, stress)).collect::<Result<Vec<_>, _>>()?;
    name_after_files(&mut histories, files)?;
    Ok(histories)
}

fn units(files: &[RecordFile]) -> Vec<Told<'_>> {
    files.iter().flat_map(|file| file.units.iter().map(move |unit| (file, unit))).collect()
}

/// How units become lives.
struct Reading<'a> {
    flags: &'a Flags,
    measures: &'a [Measure],
    time_unit: &'a str,
    stress: Stress<'a>,
}

/// Load and temperature, each with its reference.
struct Stress<'a>([Option<(&'a StressColumn, f64)>; 2]);

impl<'a> Stress<'a> {
    /// References as told, or the medians of the means of the units that teach.
    fn of(flags: &'a stress::Flags, teachers: &[Told]) -> Self {
        let mut which = 0..2;
        Self(flags.columns().map(|told| {
            let index = which.next().expect("two columns");
            let mean = |(_, unit): &Told| {
                let known: Vec<f64> = unit.rows.iter().filter_map(|row| row.stress[index]).collect();
                (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
            };
            let told = told?;
            let median = || quantile::median(&quantile::sorted(teachers.iter().filter_map(mean).collect()));
            Some((told, told.reference.or_else(median)?))
        }))
    }

    /// What acts on wear in a row.
    fn acting(&self, row: &Row) -> [Option<f64>; 2] {
        let mut values = row.stress.iter();
        self.0.map(|told| {
            let (value, (told, reference)) = (values.next().copied().flatten(), told?);
            Some(told.acting(value?, reference))
        })
    }
}

impl Reading<'_> {
    /// Lives that teach, at least one of which failed.
    fn teachers(&self, told: &[Told], notes: &mut Notes) -> Result<Records, Failure> {
        let records = self.lives(told, Untold::Removed, notes)?;
        match records.failures() {
            0 => Err(told[0].0.refuse_whole(untaught(self.measures, &records.lives))),
            _ => Ok(records),
        }
    }

    /// Lives; `untold` is known of those whose end no file tells, unless with a learned limit the record ends with the failure.
    fn lives(&self, told: &[Told], untold: Untold, notes: &mut Notes) -> Result<Records, Failure> {
        let Self { flags, measures, time_unit, ref stress } = *self;
        let ends_with_record = flags.end.is_none() && measures.iter().any(|measure| measure.learned);
        let untold = if ends_with_record { Untold::Failed } else { untold };
        Ok(Records {
            time_unit: time_unit.to_owned(),
            faults: measures.iter().map(|measure| measure.name.clone()).collect(),
            sigma: measures.iter().map(Measure::severity_sigma).collect(),
            lives: lives(told, measures, stress, untold, notes)?,
        })
    }
}

/// Of several files, a unit becomes STEM/UNIT.
fn name_after_files(histories: &mut [RecordFile], files: &[PathBuf]) -> Result<(), Failure> {
    if histories.len() == 1 {
        return Ok(());
    }
    let stems: Vec<_> = files.iter().map(|file| file.file_stem().unwrap_or_default().to_string_lossy()).collect();
    if let Some(twice) = (1..stems.len()).find(|&i| stems[..i].contains(&stems[i])) {
        let reason = format!("two files of --histories are called {}: their units would clash", stems[twice]);
        return Err(Failure::BadInput(reason));
    }
    for (file, stem) in histories.iter_mut().zip(stems) {
        file.units.iter_mut().for_each(|unit| unit.name = format!("{stem}/{}", unit.name));
    }
    Ok(())
}

fn must_count_alike<'a>(mut files: impl Iterator<Item = &'a RecordFile>) -> Result<(), Failure> {
    let unit = &files.next().expect("at least one file").time_unit;
    match files.find(|file| file.time_unit != *unit) {
        Some(other) => Err(other.refuse_whole(format!("counts in {}, another file in {unit}", other.time_unit))),
        None => Ok(()),
    }
}

/// Units that teach and units that are judged: every second from the first on teaches, or the first ones.
fn divided(units: Vec<Told>, split: Option<usize>) -> Result<(Vec<Told>, Vec<Told>), Failure> {
    let (file, count) = (units[0].0, units.len());
    let least = split.map_or(2, |split| split + 1);
    if count < least {
        let reason = format!("has {count} units: {} teach and none is left to judge; tell --prior", least - 1);
        return Err(file.refuse_whole(reason));
    }
    let (teach, judge): (Vec<_>, Vec<_>) =
        units.into_iter().enumerate().partition(|(i, _)| split.map_or(i % 2 == 0, |split| *i < split));
    let told = |units: Vec<(usize, _)>| units.into_iter().map(|(_, told)| told).collect();
    Ok((told(teach), told(judge)))
}

fn lives(
    told: &[Told],
    measures: &[Measure],
    stress: &Stress,
    untold: Untold,
    notes: &mut Notes,
) -> Result<Vec<RecordedLife>, Failure> {
    let mut lives = Vec::new();
    for &(file, unit) in told {
        let mut read = life::read((file, unit), measures, untold)?;
        if let Some(life) = &mut read.life {
            life.stress = unit.rows[..life.times.len()].iter().map(|row| stress.acting(row)).collect();
        }
        notes.life(unit, &read, untold);
        lives.extend(read.life);
    }
    Ok(lives)
}

fn untaught(measures: &[Measure], lives: &[RecordedLife]) -> String {
    let farthest = lives.iter().flat_map(|life| life.severities.iter().flatten()).fold(0.0, |a: f64, b| a.max(*b));
    let limits: Vec<String> = measures.iter().map(|measure| format!("{} {}", measure.name, measure.limit)).collect();
    format!(
        "none of the {} units that teach passes a limit ({}) or is told to have failed: nothing can be learned of failure; \
         the farthest went {:.0} % of the way",
        lives.len(),
        limits.join(", "),
        100.0 * farthest
    )
}

#[cfg(test)]
mod tests {
    use std::fs;

    use clap::Parser;
    use evaluation::RecordedEnd;
    use prognosis::Ending;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        flags: Flags,
    }

    fn flags(words: &str) -> Flags {
        Line::try_parse_from(["", &[words].concat()].concat().split(' ')).unwrap().flags
    }

    /// Tables `h.csv` and `p.csv` with these contents, read with these flags.
    fn read_tables(histories: &str, prior: Option<&str>, words: &str, split: Option<usize>) -> Result<Lives, String> {
        let folder = tempfile::tempdir().unwrap();
        let [history_file, prior_file] = ["h.csv", "p.csv"].map(|name| folder.path().join(name));
        fs::write(&history_file, histories).unwrap();
        fs::write(&prior_file, prior.unwrap_or_default()).unwrap();
        let stress = stress::Flags::default();
        let prior = prior.map(|_| prior_file.as_path());
        let tables = Tables { histories: &[history_file], prior, split, stress: &stress };
        let folder = format!("{}/", folder.path().display());
        read(tables, &flags(words)).map_err(|failure| failure.to_string().replace(&folder, ""))
    }

    /// Four units whose `x` grows by one an hour, from 0 at time 0 to 6; rows of all in turn, the latest first.
    fn four(end: u32) -> String {
        let row = |t: u32| ["a", "b", "c", "d"].map(|unit| format!("{unit},{t},{t},7\n")).concat();
        format!("unit,hours,x,site\n{}", (0..=end).rev().map(row).collect::<String>())
    }

    fn failed(time: f64) -> Option<RecordedEnd> {
        Some(RecordedEnd { time, ending: Ending::Failed })
    }

    #[test]
    fn a_life_ends_where_a_line_between_two_rows_passes_its_limit() {
        let lives = read_tables(&four(6), None, " --limit x=4.5", None).unwrap();
        let Records { time_unit, faults, lives: teach, .. } = &lives.teach;
        assert_eq!((time_unit.as_str(), &faults[..]), ("hours", &["x".to_owned()][..]));
        assert_eq!(teach.iter().map(|life| life.unit.as_str()).collect::<Vec<_>>(), ["a", "c"]);
        assert_eq!((&teach[0].times[..], teach[0].end), (&[0.0, 1.0, 2.0, 3.0, 4.0][..], failed(4.5)));
        assert_eq!(teach[0].severities[2], [2.0 / 4.5]);
        assert_eq!(lives.judge.lives.iter().map(|life| life.unit.as_str()).collect::<Vec<_>>(), ["b", "d"]);
        let notes = lives.notes.join("; ");
        assert!(notes.contains("columns without a limit are ignored: site"), "{notes}");
        assert!(notes.contains("8 rows after the end of their unit are not read"), "{notes}");
        assert!(notes.contains("2 of the 4 units teach (the 1st, 3rd, 5th..."), "{notes}");
    }

    #[test]
    fn the_order_of_rows_within_units_changes_nothing() {
        let mut rows: Vec<String> = four(6).lines().map(str::to_owned).collect();
        rows[5..].reverse();
        let shuffled = rows.join("\n");
        let [a, b] = [&four(6), &shuffled].map(|table| read_tables(table, None, " --limit x=4", None).unwrap());
        assert_eq!((a.teach, a.judge), (b.teach, b.judge));
    }

    #[test]
    fn limits_have_directions_and_may_be_relative_to_the_nominal_value_of_a_unit() {
        let table = "cell,cycle,ah\na,1,2\na,2,1.9\na,3,1.5\nb,1,1\nb,2,.9\nb,3,.7\n";
        let lives = read_tables(table, None, " --limit ah=-20% --nominal ah=first:1 --sigma ah=.03", None).unwrap();
        let (a, b) = (&lives.teach.lives[0], &lives.judge.lives[0]);
        assert!((a.severities[1][0] - 0.25).abs() < 1e-12 && (b.severities[1][0] - 0.5).abs() < 1e-12);
        assert!((a.end.unwrap().time - 2.75).abs() < 1e-12 && (b.end.unwrap().time - 2.5).abs() < 1e-12);
        assert!((lives.teach.sigma[0].unwrap() - 0.03 / 0.4).abs() < 1e-12);
        assert!((lives.measures[0].nominal, lives.measures[0].limit) == (2.0, 1.6));
        let median = read_tables(table, None, " --limit ah=-20% --nominal ah=first:2", None).unwrap();
        assert!((median.measures[0].nominal - 1.95).abs() < 1e-12);
    }

    #[test]
    fn the_first_of_several_limits_ends_a_life() {
        let table = "id,t,x,y\na,0,0,0\na,1,1,1\na,2,2,8\nb,0,0,0\nb,1,1,0\nb,2,3,0\n";
        let lives = read_tables(table, None, " --limit x=1.5 --limit y=8", None).unwrap();
        assert_eq!((lives.teach.lives[0].end, lives.judge.lives[0].end), (failed(1.5), failed(1.25)));
        let lives = read_tables(table, None, " --limit x=1.9 --limit y=4.5", None).unwrap();
        assert_eq!(lives.teach.lives[0].end, failed(1.5));
    }

    #[test]
    fn ends_are_told_by_the_last_row_and_a_passage_comes_first() {
        let table = "unit,t,x,how\n\
            a,0,0,\na,1,1,removed\na,2,2,\nb,0,0,removed\nb,2,5,\nc,0,0,\nc,3,2,failed\nd,0,0,\nd,4,2,Removed\ne,0,0,\ne,2,5,removed\n";
        let ends = |lives: &Records| lives.lives.iter().map(|life| life.end).collect::<Vec<_>>();
        let removed = |time| Some(RecordedEnd { time, ending: Ending::Removed });
        let lives = read_tables(table, None, " --limit x=4 --end how", Some(4)).unwrap();
        assert_eq!(ends(&lives.teach), [removed(2.0), failed(1.6), failed(3.0), removed(4.0)]);
        assert_eq!(ends(&lives.judge), [failed(1.6)]);
        let notes = lives.notes.join("; ");
        assert!(notes.contains("unit c told to have failed without passing a limit"), "{notes}");
        assert!(notes.contains("unit a passing no limit until the last time: taken to be removed there"), "{notes}");
        assert!(notes.contains("unit e told to be removed after passing a limit: failed at the passage"), "{notes}");
        let lives = read_tables("unit,hours,x\nz,0,0\nz,1,1\n", Some(&four(6)), " --limit x=5", None).unwrap();
        assert_eq!((ends(&lives.judge), lives.teach.lives.len()), (vec![None], 4));
        assert!(!lives.notes.join("; ").contains("taught, too"), "{:?}", lives.notes);
        let both = read_tables(&four(6), Some(&four(6)), " --limit x=5", None).unwrap().notes.join("; ");
        assert!(both.contains("4 units (such as a) taught, too: figures flatter"), "{both}");
        assert!(lives.notes.iter().any(|note| note == "unit z going on at the last time: predicted, not judged"));
    }

    #[test]
    fn a_limit_may_be_learned_from_lives_that_teach_alone_and_ends_none() {
        let table = "unit,cycle,h\na,1,0\na,9,3\nb,1,0\nb,5,100\nc,1,0\nc,8,5\nd,1,0\nd,7,50\n";
        let lives = read_tables(table, None, " --limit h=learned", None).unwrap();
        assert_eq!((lives.measures[0].limit, lives.teach.lives[1].end), (4.0, failed(8.0)));
        assert_eq!((lives.judge.lives[0].end, lives.judge.lives[0].times.len()), (failed(5.0), 2));
        assert!(
            lives
                .notes
                .iter()
                .any(|note| note.starts_with("4 units (such as a) taken to have failed where the record ends"))
        );
    }

    #[test]
    fn columns_are_found_by_their_usual_names_or_told() {
        let header = |line: &str, words: &str| {
            let rows = "a,0,0,0\na,1,1,5\nb,0,0,0\nb,1,1,5\n";
            read_tables(
                &format!("{line}\n{rows}"),
                None,
                &format!(" --limit x=4 {words}").trim_end().replace("  ", " "),
                None,
            )
            .map(|lives| lives.teach.time_unit)
        };
        assert_eq!(header("unit,t_fh,u,x", ""), Ok("h".to_owned()));
        assert_eq!(header("Cell,u,Cycle,x", ""), Ok("Cycle".to_owned()));
        assert_eq!(header("who,when,u,x", " --unit who --time when:years"), Ok("years".to_owned()));
        assert_eq!(header("unit,a:b,u,x", " --time a:b"), Ok("a:b".to_owned()));
        let refused = |line: &str, words: &str| header(line, words).unwrap_err();
        assert!(
            refused("unit,t,days,x", "")
                .contains("h.csv: both t and days may be the column that counts time: tell --time")
        );
        assert!(refused("unit,u,v,x", "").contains("h.csv: no column counts time (none of t, time"));
        assert!(
            refused("unit,t,id,x", "").contains("both unit and id may be the column that names the unit: tell --unit")
        );
        assert!(refused("who,t,u,x", "").contains("no column names the unit"));
        assert!(refused("unit,t,u,x", " --end how").contains("h.csv: column how is missing"));
        assert!(refused("unit,t,u,x", " --time x").contains("column x cannot be two things at once"));
    }

    #[test]
    fn what_cannot_be_learned_from_is_refused_in_a_line() {
        let says = |table: &str, words: &str, expected: &str| {
            let refused = read_tables(table, None, words, None).unwrap_err();
            assert!(refused.contains(expected), "{refused} should say {expected}");
        };
        let rows = |rows: &str| format!("unit,t,x,how\na,0,0,\na,9,9,\nb,0,0,\n{rows}");
        says(
            &rows("b,9,9,\n"),
            " --limit y=5",
            "h.csv: column y of --limit is missing: the columns are unit, t, x, how",
        );
        says(&rows(""), " --limit x=5", "h.csv, row 4, column t: unit b has no other row");
        says(&rows("b,9,inf,\n"), " --limit x=5", "h.csv, row 5, column x: inf is not finite");
        says(&rows("b,9,,\n"), " --limit x=5", "h.csv, row 5, column x: empty");
        says(&rows("b,-9,1,\n"), " --limit x=5", "h.csv, row 5, column t: -9 is before the start of the life");
        says(&rows("b,0,1,\n"), " --limit x=5", "h.csv, row 5, column x: unit b has another value at 0 already");
        says(
            &rows("b,9,9,lost\n"),
            " --limit x=5 --end how",
            "h.csv, row 5, column how: \"lost\" is neither failed nor removed",
        );
        says(&rows("b,9,9,\n"), " --limit x=0", "h.csv, row 2, column x: the limit 0 is the nominal value, too");
        says(
            &rows("b,9,9,\n"),
            " --limit x=-5",
            "h.csv, row 3, column x: unit a and most others move away from the limit -5",
        );
        says(
            &rows("b,9,9,\n"),
            " --limit x=-2 --nominal x=-5",
            "h.csv, row 2, column x: 0 is beyond the limit -2 in the first row",
        );
        says(&rows("b,9,9,\n"), " --limit x=50", "none of the 1 units that teach passes a limit (x 50)");
        says(&rows("b,9,9,\n"), " --limit x=5 --limit x=6", "--limit tells of x twice");
        says("unit,t,x\na,0,3\na,9,3\nb,0,0\nb,9,9\n", " --limit x=5", "h.csv, row 2, column x: x never moves from 3");
        says("unit,t,x\na,0,0\na,9,9\n", " --limit x=5", "h.csv: has 1 units: 1 teach and none is left to judge");
    }
}
