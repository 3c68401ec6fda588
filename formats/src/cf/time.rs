//! Dates from numbers: `days since 1979-01-01` and its kin, in the calendars of CF section 4.4.1.
//!
//! Days are counted exactly, in whole numbers; the time of day is kept to the millisecond. Years are astronomical: 0
//! comes before 1. Months of `months since` are those of the calendar, and a part of one is that part of its days.

use std::fmt;

/// Milliseconds of a day.
const DAY: i64 = 86_400_000;

/// Times farther than this from their reference, in days, are no dates: it is 2.7 million years.
const DAYS_MAX: f64 = 1e9;

/// Julian day number of the first day of year 0 in the Gregorian calendar.
const YEAR_0_GREGORIAN: i64 = 1_721_060;

/// The same in the Julian calendar.
const YEAR_0_JULIAN: i64 = 1_721_058;

/// Julian day number of 1582-10-15, the first day of the Gregorian calendar in use.
const REFORM: i64 = 2_299_161;

/// How years are made of months and days.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Calendar {
    /// Julian up to 1582-10-04, Gregorian from 1582-10-15, which is the day after.
    Standard,
    Gregorian,
    Julian,
    /// No leap years.
    Days365,
    /// Leap years only.
    Days366,
    /// Twelve months of 30 days.
    Days360,
}

/// A year, a month and a day, both from 1.
type Date = (i64, i64, i64);

impl Calendar {
    /// By the name that CF has for it.
    fn named(name: &str) -> Option<Self> {
        Some(match name.trim().to_ascii_lowercase().as_str() {
            "standard" | "gregorian" => Calendar::Standard,
            "proleptic_gregorian" => Calendar::Gregorian,
            "julian" => Calendar::Julian,
            "noleap" | "365_day" => Calendar::Days365,
            "all_leap" | "366_day" => Calendar::Days366,
            "360_day" => Calendar::Days360,
            _ => return None,
        })
    }

    fn is_leap(self, year: i64) -> bool {
        let every = |years: i64| year.rem_euclid(years) == 0;
        match self {
            Calendar::Standard | Calendar::Gregorian => every(4) && (!every(100) || every(400)),
            Calendar::Julian => every(4),
            Calendar::Days366 => true,
            Calendar::Days365 | Calendar::Days360 => false,
        }
    }

    fn days_in_month(self, year: i64, month: i64) -> i64 {
        match month {
            _ if self == Calendar::Days360 => 30,
            2 if self.is_leap(year) => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        }
    }

    /// The number of the first day of a year. The numbers of all three Gregorian and Julian calendars are Julian day
    /// numbers.
    fn new_year(self, year: i64) -> i64 {
        // Multiples of `n` from 0 up to the year before.
        let multiples = |n: i64| (year + n - 1).div_euclid(n);
        match self {
            Calendar::Standard | Calendar::Gregorian => {
                YEAR_0_GREGORIAN + 365 * year + multiples(4) - multiples(100) + multiples(400)
            }
            Calendar::Julian => YEAR_0_JULIAN + 365 * year + multiples(4),
            Calendar::Days365 => 365 * year,
            Calendar::Days366 => 366 * year,
            Calendar::Days360 => 360 * year,
        }
    }

    /// The number of a day; nothing for a date that the calendar does not have.
    fn day(self, date: Date) -> Option<i64> {
        let (year, month, day) = date;
        if self == Calendar::Standard {
            // The first ten days after the reform are in neither part.
            let new = Calendar::Gregorian.day(date).filter(|&day| day >= REFORM);
            return new.or_else(|| Calendar::Julian.day(date).filter(|&day| day < REFORM));
        }
        let exists = (1..=12).contains(&month) && (1..=self.days_in_month(year, month)).contains(&day);
        let before: i64 = (1..month).map(|month| self.days_in_month(year, month)).sum();
        exists.then(|| self.new_year(year) + before + day - 1)
    }

    /// The date of a day.
    fn date(self, day: i64) -> Date {
        if self == Calendar::Standard {
            return if day >= REFORM { Calendar::Gregorian.date(day) } else { Calendar::Julian.date(day) };
        }
        // A guess from the mean year, in a cycle of 400, is nearly right.
        let cycle = self.new_year(400) - self.new_year(0);
        let mut year = ((day - self.new_year(0)) * 400).div_euclid(cycle);
        while self.new_year(year) > day {
            year -= 1;
        }
        while self.new_year(year + 1) <= day {
            year += 1;
        }
        let (mut month, mut left) = (1, day - self.new_year(year));
        while left >= self.days_in_month(year, month) {
            left -= self.days_in_month(year, month);
            month += 1;
        }
        (year, month, left + 1)
    }
}

/// A point in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moment {
    date: Date,
    /// Since midnight.
    milliseconds: i64,
}

impl fmt::Display for Moment {
    /// The date, and the time of day as far as it is not all zero; in full as the alternate form.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ((year, month, day), ms) = (self.date, self.milliseconds);
        let sign = if year < 0 { "-" } else { "" };
        write!(f, "{sign}{:04}-{month:02}-{day:02}", year.abs())?;
        if ms != 0 || f.alternate() {
            write!(f, "T{:02}:{:02}", ms / 3_600_000, ms / 60_000 % 60)?;
        }
        if ms % 60_000 != 0 || f.alternate() {
            write!(f, ":{:02}", ms / 1000 % 60)?;
        }
        if ms % 1000 != 0 {
            write!(f, ".{:03}", ms % 1000)?;
        }
        Ok(())
    }
}

/// The unit in which numbers of a time coordinate are counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimeUnits {
    calendar: Calendar,
    /// Milliseconds; nothing where it is the calendar's months.
    unit: Option<i64>,
    /// Number of the reference's day.
    day: i64,
    /// Milliseconds since its midnight, perhaps beyond the day for another time zone.
    milliseconds: i64,
}

impl TimeUnits {
    /// Reads such as `hours since 1900-01-01 00:00:0.0`; nothing where it is not understood.
    pub(super) fn parse(units: &str, calendar: &str) -> Option<Self> {
        let calendar = Calendar::named(calendar)?;
        let mut words = units.split_whitespace();
        let unit = match words.next()?.to_ascii_lowercase().as_str() {
            "days" | "day" | "d" => Some(DAY),
            "hours" | "hour" | "hrs" | "hr" | "h" => Some(3_600_000),
            "minutes" | "minute" | "mins" | "min" => Some(60_000),
            "seconds" | "second" | "secs" | "sec" | "s" => Some(1000),
            "months" | "month" => None,
            _ => return None,
        };
        if !words.next()?.eq_ignore_ascii_case("since") {
            return None;
        }
        let rest = words.collect::<Vec<_>>().join(" ");
        let (date, time) = rest.split_once([' ', 'T', 't']).unwrap_or((&rest, ""));
        let day = calendar.day(parse_date(date)?)?;
        Some(TimeUnits { calendar, unit, day, milliseconds: parse_time(time)? })
    }

    /// The point in time that a number stands for, if it is within reach.
    pub(super) fn moment(&self, value: f64) -> Option<Moment> {
        let (mut day, mut milliseconds) = (self.day, self.milliseconds);
        match self.unit {
            Some(unit) => {
                let per_day = (DAY / unit) as f64;
                let days = (value / per_day).floor();
                if days.is_nan() || days.abs() > DAYS_MAX {
                    return None;
                }
                day += days as i64;
                // What is left of the day is exact, since both numbers are multiples of the value's last digit.
                milliseconds += ((value - days * per_day) * unit as f64).round() as i64;
            }
            None => {
                if value.is_nan() || value.abs() > DAYS_MAX / 30.0 {
                    return None;
                }
                let (year, month, of_month) = self.calendar.date(day);
                let months = year * 12 + month - 1 + value.floor() as i64;
                let (year, month) = (months.div_euclid(12), months.rem_euclid(12) + 1);
                let length = self.calendar.days_in_month(year, month);
                day = self.calendar.day((year, month, of_month.min(length)))?;
                milliseconds += ((value - value.floor()) * (length * DAY) as f64).round() as i64;
            }
        }
        day += milliseconds.div_euclid(DAY);
        Some(Moment { date: self.calendar.date(day), milliseconds: milliseconds.rem_euclid(DAY) })
    }
}

/// A date such as `1979-01-01`, `1-1-1` or `-4712-1-1`.
fn parse_date(text: &str) -> Option<Date> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text),
    };
    let mut parts = digits.split('-').map(small_number);
    let (year, month, day) = (parts.next()??, parts.next().unwrap_or(Some(1))?, parts.next().unwrap_or(Some(1))?);
    parts.next().is_none().then_some((sign * year, month, day))
}

/// Milliseconds since midnight of a time such as `06:00`, `00:00:0.0`, `6Z`, `12:00:00 UTC` or `00:00 +01:00`, brought to
/// UTC.
fn parse_time(text: &str) -> Option<i64> {
    let text = text.trim().to_ascii_uppercase();
    let text = ["UTC", "GMT", "Z"].iter().find_map(|zone| text.strip_suffix(zone)).unwrap_or(&text).trim_end();
    let (clock, zone) = match text.find(['+', '-']) {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    Some(parse_clock(clock.trim_end())? - parse_zone(zone)?)
}

/// Milliseconds of `hours:minutes:seconds`, of which later ones may lack.
fn parse_clock(text: &str) -> Option<i64> {
    if text.is_empty() {
        return Some(0);
    }
    let mut parts = text.split(':');
    let (hours, minutes) = (small_number(parts.next()?)?, small_number(parts.next().unwrap_or("0"))?);
    let seconds: f64 = parts.next().unwrap_or("0").parse().ok()?;
    let exists = hours <= 24 && minutes < 60 && (0.0..=60.0).contains(&seconds) && parts.next().is_none();
    exists.then(|| hours * 3_600_000 + minutes * 60_000 + (seconds * 1000.0).round() as i64)
}

/// Milliseconds that a time zone such as `+01:00`, `-0530` or `+1` is ahead of UTC.
fn parse_zone(text: &str) -> Option<i64> {
    let (sign, digits) = match text.split_at_checked(1) {
        Some(("+", digits)) => (1, digits),
        Some(("-", digits)) => (-1, digits),
        _ => return Some(0),
    };
    let (hours, minutes) = match digits.split_once(':') {
        Some(parts) => parts,
        None if digits.len() > 2 => digits.split_at_checked(digits.len() - 2)?,
        None => (digits, "0"),
    };
    Some(sign * (small_number(hours)? * 60 + small_number(minutes)?) * 60_000)
}

/// Up to six digits, so that no sum of what they stand for overflows.
fn small_number(text: &str) -> Option<i64> {
    let digits = !text.is_empty() && text.len() <= 6 && text.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALENDARS: [Calendar; 6] = [
        Calendar::Standard,
        Calendar::Gregorian,
        Calendar::Julian,
        Calendar::Days365,
        Calendar::Days366,
        Calendar::Days360,
    ];

    fn date(value: f64, units: &str, calendar: &str) -> String {
        let units = TimeUnits::parse(units, calendar).unwrap_or_else(|| panic!("'{units}' in '{calendar}'"));
        units.moment(value).unwrap().to_string()
    }

    #[test]
    fn days_and_dates_are_each_other_s_inverse() {
        for calendar in CALENDARS {
            // Two leap cycles about year 0, and the reform.
            let days =
                [calendar.new_year(-401)..calendar.new_year(401), calendar.new_year(1580)..calendar.new_year(2030)];
            let mut before = None;
            for day in days.into_iter().flatten() {
                let date = calendar.date(day);
                assert_eq!(calendar.day(date), Some(day), "{calendar:?} {date:?}");
                // Dates follow each other.
                let (y, m, d) = date;
                if let Some((by, bm, bd)) = before.replace(date).filter(|_| d != 1) {
                    let reform = calendar == Calendar::Standard && date == (1582, 10, 15);
                    let next = (y, m) == (by, bm) && (d == bd + 1 || reform && bd == 4);
                    assert!(next || date == calendar.date(calendar.new_year(1580)), "{calendar:?} {date:?}");
                }
            }
        }
    }

    #[test]
    fn dates_far_away_are_found_at_once() {
        for calendar in CALENDARS {
            for day in [-900_000_000, 900_000_000] {
                assert_eq!(calendar.day(calendar.date(day)), Some(day));
            }
        }
    }

    #[test]
    fn known_dates() {
        let days = |value, calendar| date(value, "days since 1582-10-04", calendar);
        assert_eq!(days(1.0, "standard"), "1582-10-15");
        assert_eq!(days(1.0, "proleptic_gregorian"), "1582-10-05");
        assert_eq!(days(1.0, "julian"), "1582-10-05");
        assert_eq!(date(0.0, "days since -4712-01-01 12:00", "julian"), "-4712-01-01T12:00");
        assert_eq!(date(2_451_545.0, "days since -4712-01-01 12:00", "standard"), "2000-01-01T12:00");
        assert_eq!(date(946_684_800.0, "seconds since 1970-01-01T00:00:00Z", "gregorian"), "2000-01-01");
        assert_eq!(date(1.0, "days since 2001-02-28", "noleap"), "2001-03-01");
        assert_eq!(date(1.0, "days since 2001-02-28", "all_leap"), "2001-02-29");
        assert_eq!(date(2.0, "days since 2001-02-28", "360_day"), "2001-02-30");
        assert_eq!(date(1.0, "days since 2000-02-28", "365_day"), "2000-03-01");
    }

    /// Dates that cftime (python) has for numbers, one for each calendar and reference.
    #[test]
    fn dates_of_cftime() {
        let dates: [(&str, &str, f64, &str); 30] = [
            ("standard", "days since 1800-01-01 00:00:00", -59109.0, "1638-03-02T00:00:00"),
            ("standard", "hours since 0001-01-01 00:00:00", 483672.0, "0056-03-06T00:00:00"),
            ("standard", "seconds since 1970-01-01 12:00:00", 6848668800.0, "2187-01-10T12:00:00"),
            ("standard", "minutes since 2100-02-28 23:59:00", 287598240.0, "2646-12-24T23:59:00"),
            ("standard", "days since 1582-10-04", 379715.0, "2622-05-30T00:00:00"),
            ("proleptic_gregorian", "days since 1800-01-01 00:00:00", 236396.0, "2447-03-26T00:00:00"),
            ("proleptic_gregorian", "hours since 0001-01-01 00:00:00", 7977120.0, "0911-01-11T00:00:00"),
            ("proleptic_gregorian", "seconds since 1970-01-01 12:00:00", 4711500000.0, "2119-04-21T18:00:00"),
            ("proleptic_gregorian", "minutes since 2100-02-28 23:59:00", 479697120.0, "3012-03-22T23:59:00"),
            ("proleptic_gregorian", "days since 1582-10-04", -154401.0, "1160-01-09T00:00:00"),
            ("julian", "days since 1800-01-01 00:00:00", 365829.0, "2801-08-02T00:00:00"),
            ("julian", "hours since 0001-01-01 00:00:00", 4855848.0, "0554-12-11T00:00:00"),
            ("julian", "seconds since 1970-01-01 12:00:00", 34360156800.0, "3058-10-23T12:00:00"),
            ("julian", "minutes since 2100-02-28 23:59:00", -285607440.0, "1557-02-20T11:59:00"),
            ("julian", "days since 1582-10-04", -103949.0, "1298-02-28T00:00:00"),
            ("noleap", "days since 1800-01-01 00:00:00", 94856.0, "2059-11-18T00:00:00"),
            ("noleap", "hours since 0001-01-01 00:00:00", 1622712.0, "0186-03-30T00:00:00"),
            ("noleap", "seconds since 1970-01-01 12:00:00", 27700812000.0, "2848-05-22T18:00:00"),
            ("noleap", "minutes since 2100-02-28 23:59:00", -4070160.0, "2092-06-02T11:59:00"),
            ("noleap", "days since 1582-10-04", 36321.0, "1682-04-08T00:00:00"),
            ("all_leap", "days since 1800-01-01 00:00:00", 371161.0, "2814-02-07T00:00:00"),
            ("all_leap", "hours since 0001-01-01 00:00:00", 5928168.0, "0675-11-19T00:00:00"),
            ("all_leap", "seconds since 1970-01-01 12:00:00", -10354219200.0, "1642-07-27T00:00:00"),
            ("all_leap", "minutes since 2100-02-28 23:59:00", 558653760.0, "3160-02-22T23:59:00"),
            ("all_leap", "days since 1582-10-04", 163783.0, "2030-04-02T00:00:00"),
            ("360_day", "days since 1800-01-01 00:00:00", 110454.0, "2106-10-25T00:00:00"),
            ("360_day", "hours since 0001-01-01 00:00:00", 254628.0, "0030-06-20T12:00:00"),
            ("360_day", "seconds since 1970-01-01 12:00:00", -8545975200.0, "1695-03-29T18:00:00"),
            ("360_day", "minutes since 2100-02-28 23:59:00", -189367200.0, "1734-11-13T23:59:00"),
            ("360_day", "days since 1582-10-04", 81028.0, "1807-11-02T00:00:00"),
        ];
        for (calendar, units, value, expected) in dates {
            let units = TimeUnits::parse(units, calendar).unwrap();
            assert_eq!(format!("{:#}", units.moment(value).unwrap()), expected, "{value} {calendar}");
        }
    }

    #[test]
    fn units_as_they_are_met() {
        for units in [
            "hours since 2000-1-1",
            "hours since 2000-01-01 00:00:0.0",
            "Hours since 2000-01-01T00:00:00Z",
            "h since 2000-01-01 00:00 UTC",
            "hr since 2000-01-01 0",
            "hours  since  2000-01-01  01:00:00 +01:00",
            "hours since 2000-01-01 05:30 +0530",
            "hours since 1999-12-31 23:00 -1",
            "hours since 2000-01-01 00:00:00 -0:00",
            "hours since 2000",
        ] {
            assert_eq!(date(18.0, units, "standard"), "2000-01-01T18:00", "{units}");
        }
        assert_eq!(date(1.5, "minutes since 2000-01-01", "standard"), "2000-01-01T00:01:30");
        assert_eq!(date(0.25, "s since 2000-01-01", "standard"), "2000-01-01T00:00:00.250");
        assert_eq!(date(-0.5, "days since 2000-01-01", "standard"), "1999-12-31T12:00");
        // The nearest double to an hour is not an hour.
        assert_eq!(date(73_000.0 + 1.0 / 24.0, "days since 1800-01-01", "standard"), "1999-11-14T01:00");
        assert_eq!(date(1.5, "months since 1960-01-01", "360_day"), "1960-02-16");
        assert_eq!(date(-1.0, "months since 2000-01-31", "standard"), "1999-12-31");
        assert_eq!(date(1.0, "months since 2000-01-31", "standard"), "2000-02-29");
        assert_eq!(date(13.5, "months since 2000-01-01", "standard"), "2001-02-15");
    }

    #[test]
    fn in_full() {
        let units = TimeUnits::parse("days since 2000-01-01", "standard").unwrap();
        assert_eq!(format!("{:#}", units.moment(0.0).unwrap()), "2000-01-01T00:00:00");
    }

    #[test]
    fn units_that_say_nothing() {
        for (units, calendar) in [
            ("days", "standard"),
            ("", "standard"),
            ("days since", "standard"),
            ("parsecs since 2000-01-01", "standard"),
            ("days since yesterday", "standard"),
            ("days since 2000-13-01", "standard"),
            ("days since 2000-02-30", "standard"),
            ("days since 1582-10-10", "standard"),
            ("days since 2000-01-01-01", "standard"),
            ("days since 2000-01-01 25:00", "standard"),
            ("days since 2000-01-01 00:00:00:00", "standard"),
            ("days since 2000-01-01 00:00 +\u{e9}1", "standard"),
            ("days since 99999999999999999999-01-01", "standard"),
            ("day as %Y%m%d.%f", "standard"),
            ("days since 2000-01-01", "none"),
        ] {
            assert!(TimeUnits::parse(units, calendar).is_none(), "{units} {calendar}");
        }
        let units = TimeUnits::parse("days since 2000-01-01", "standard").unwrap();
        assert!([f64::NAN, f64::INFINITY, -1e300, 1e10].iter().all(|&value| units.moment(value).is_none()));
        let months = TimeUnits::parse("months since 2000-01-01", "standard").unwrap();
        assert!([f64::NAN, f64::INFINITY, -1e300, 1e10].iter().all(|&value| months.moment(value).is_none()));
    }
}
