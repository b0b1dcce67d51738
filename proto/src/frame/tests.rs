use domain::{AirData, ContentHash, FrameSubject, LoadRatio, MapSamples, Reading, Strain, Upload};
use proptest::{collection::vec, option, prelude::*};

use super::*;

/// The page that has the bytes.
const PAGE: &str = include_str!("../../../docs/uplink.md");

fn installation() -> InstallationKey {
    InstallationKey::new(std::array::from_fn(|i| i as u8))
}

fn subject() -> FrameSubject {
    FrameSubject::Actuator {
        tail: "EC-MXA".parse().unwrap(),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-500".parse().unwrap(),
        serial_number: "SN-0001".parse().unwrap(),
        mask_id: ContentHash::of(b"mask"),
    }
}

fn wing() -> FrameSubject {
    FrameSubject::Strain { tail: "EC-MXA".parse().unwrap() }
}

fn key_of(subject: &FrameSubject) -> FrameKey {
    installation().derive("0123456789abcdef".parse().unwrap(), &Default::default(), subject)
}

fn key() -> FrameKey {
    key_of(&subject())
}

/// All that a frame can say: thirty samples of which one is missing, with a load ratio each.
fn upload() -> Upload {
    let sample = |i: usize| (i != 7).then_some(0.0752 + 1e-4 * i as f64);
    let ratio = |i: usize| (i != 7).then_some(0.02 * i as f64 - 0.3);
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: key().id().upload_id(123),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-500".parse().unwrap(),
        serial_number: "SN-0001".parse().unwrap(),
        flight_hours: 1234.5,
        flight_cycles: Some(987),
        recorded_at: "2026-03-01T12:30:00Z".parse().unwrap(),
        reading: Reading::Samples(MapSamples {
            mask_id: ContentHash::of(b"mask"),
            samples: (0..30).map(sample).collect(),
            load_ratio: Some(LoadRatio::PerSample((0..30).map(ratio).collect())),
            sample_noise: Some(0.01),
        }),
        strain: Some(Strain {
            wavelengths_nm: (0..12).map(|i| (i != 3).then(|| 1530.0 + 0.1234 * f64::from(i))).collect(),
            temperature_wavelengths_nm: (0..4).map(|i| Some(1560.5 + f64::from(i))).collect(),
        }),
        air_data: Some(AirData {
            dynamic_pressure_pa: 9_000.0,
            airspeed_m_s: 230.25,
            angle_of_attack_rad: 0.0435,
            roll_rate_rad_s: -0.125,
            flap_rad: 0.0,
            aileron_rad: 0.1745,
        }),
        temperature_c: Some(-54.25),
        winding_temperature_c: Some(81.5),
        on_ground: Some(false),
    }
}

fn frame_of(upload: &Upload) -> Result<Frame, domain::Invalid> {
    Measured::of(upload, &subject())?.frame(123, &key())
}

fn frame() -> Frame {
    frame_of(&upload()).unwrap()
}

fn strain_frame() -> Frame {
    let strain = MeasuredStrain::of(&upload(), &wing()).unwrap().unwrap();
    strain.frame(45, &key_of(&wing())).unwrap()
}

fn opened(frame: &Frame) -> Measured {
    match frame.open(&key()) {
        Ok(Content::Actuator(measured)) => measured,
        other => panic!("{other:?}"),
    }
}

fn pointers(upload: &Upload) -> Vec<String> {
    frame_of(upload).unwrap_err().violations.into_iter().map(|violation| violation.pointer).collect()
}

fn samples(upload: &mut Upload) -> &mut MapSamples {
    upload.reading.samples_mut().unwrap()
}

#[test]
fn thirty_samples_with_all_that_belongs_to_them_fit_one_block() {
    assert_eq!((frame().bytes().len(), to_base32(frame().bytes()).len()), (128, 205));
    assert_eq!((strain_frame().bytes().len(), to_base32(strain_frame().bytes()).len()), (73, 117));
    assert_eq!(to_base32(&[0; MAX_BYTES]).len(), 210);
}

#[test]
fn a_frame_and_its_strain_are_the_upload_to_within_a_step() {
    let (sent, measured) = (upload(), opened(&frame()));
    let Ok(Content::Strain(strain)) = strain_frame().open(&key_of(&wing())) else { panic!("strain") };
    let joined = join(frame().key().upload_id(frame().counter()), (measured, subject()), Some((strain, wing())));
    let mut joined = joined.unwrap();
    let (told, known) = (joined.reading.samples().unwrap(), sent.reading.samples().unwrap());
    let within = |told: &[Option<f64>], known: &[Option<f64>], step: f64| {
        told.iter().zip(known).all(|(told, known)| match (told, known) {
            (Some(told), Some(known)) => (told - known).abs() <= 0.5 * step,
            (told, known) => told == known,
        })
    };
    assert!(within(&told.samples, &known.samples, 2_f64.powi(-14)), "{told:?}");
    let (Some(LoadRatio::PerSample(r)), Some(LoadRatio::PerSample(of))) = (&told.load_ratio, &known.load_ratio) else {
        panic!("{told:?}")
    };
    assert!(within(r, of, 2_f64.powi(-8)), "{r:?}");
    // Everything else stands on a step, and comes back as it was.
    let known = known.clone();
    (samples(&mut joined).samples, samples(&mut joined).load_ratio) = (known.samples, known.load_ratio);
    assert_eq!(joined, sent);
    assert_eq!(frame_of(&joined), Ok(frame()), "the same upload is the same frame");
}

#[test]
fn strain_joins_what_was_measured_in_the_same_second_on_the_same_tail() {
    let Ok(Content::Strain(strain)) = strain_frame().open(&key_of(&wing())) else { panic!("strain") };
    let refused = |strain: MeasuredStrain, of: FrameSubject| {
        let id = key().id().upload_id(1);
        join(id, (opened(&frame()), subject()), Some((strain, of))).unwrap_err().to_string()
    };
    let later =
        MeasuredStrain { recorded_at: strain.recorded_at.plus_hours(1.0 / 3600.0), strain: strain.strain.clone() };
    assert!(refused(later, wing()).contains("2026-03-01T12:30:01Z"));
    let elsewhere = FrameSubject::Strain { tail: "EC-MXB".parse().unwrap() };
    assert!(refused(strain.clone(), elsewhere).contains("EC-MXA"));
    assert!(refused(strain, subject()).contains("EC-MXA"));
}

#[test]
fn each_field_that_no_frame_can_say_is_named() {
    let mut bad = upload();
    (bad.flight_hours, bad.flight_cycles, bad.temperature_c) = (500_000.5, Some(10_000_001), Some(f64::NAN));
    (bad.winding_temperature_c, samples(&mut bad).sample_noise) = (Some(300.5), Some(1.01));
    let air = bad.air_data.as_mut().unwrap();
    (air.dynamic_pressure_pa, air.airspeed_m_s, air.aileron_rad) = (131_001.0, -1.0, 1.7);
    samples(&mut bad).samples[3] = Some(f64::INFINITY);
    samples(&mut bad).samples[4] = Some(40_000.0);
    samples(&mut bad).load_ratio = Some(LoadRatio::PerSample([Some(10.5), None].repeat(15)));
    bad.recorded_at = "2106-02-07T06:28:16Z".parse().unwrap();
    let named = pointers(&bad);
    for pointer in [
        "#/recorded_at",
        "#/flight_hours",
        "#/flight_cycles",
        "#/temperature_c",
        "#/winding_temperature_c",
        "#/sample_noise",
        "#/air_data/dynamic_pressure_pa",
        "#/air_data/airspeed_m_s",
        "#/air_data/aileron_rad",
        "#/samples/3",
        "#/samples/4",
        "#/load_ratio/0",
        "#/load_ratio/28",
    ] {
        assert!(named.iter().any(|named| named == pointer), "{pointer}: {named:?}");
    }
    assert_eq!(named.len(), 13 + 13, "and no others: {named:?}");
    let mut bad = upload();
    samples(&mut bad).load_ratio = Some(LoadRatio::Mean(-10.1));
    assert_eq!(pointers(&bad), ["#/load_ratio"]);
    samples(&mut bad).load_ratio = Some(LoadRatio::PerSample(vec![None; 29]));
    assert_eq!(pointers(&bad), ["#/load_ratio"]);
    let long = vec![Some(0.07); 32];
    (samples(&mut bad).samples, samples(&mut bad).load_ratio) = (long.clone(), Some(LoadRatio::PerSample(long)));
    assert_eq!(pointers(&bad), ["#/samples"], "132 bytes are more than one block");
    let mut strain = MeasuredStrain::of(&upload(), &wing()).unwrap().unwrap();
    (strain.strain.wavelengths_nm[5], strain.strain.temperature_wavelengths_nm) = (Some(3_000.1), vec![None; 5]);
    let named = strain.frame(1, &key_of(&wing())).unwrap_err().violations;
    let named: Vec<_> = named.into_iter().map(|violation| violation.pointer).collect();
    assert_eq!(named, ["#/strain/wavelengths_nm/5", "#/strain/temperature_wavelengths_nm"]);
}

#[test]
fn a_key_speaks_for_nothing_but_its_subject() {
    let mut other = upload();
    (other.tail, other.position) = ("EC-MXB".parse().unwrap(), "AIL-R".parse().unwrap());
    (other.part_number, other.serial_number) = ("EMA-501".parse().unwrap(), "SN-0002".parse().unwrap());
    samples(&mut other).mask_id = ContentHash::of(b"another mask");
    assert_eq!(pointers(&other), ["#/tail", "#/position", "#/part_number", "#/serial_number", "#/mask_id"]);
    assert!(Measured::of(&upload(), &wing()).is_err() && MeasuredStrain::of(&upload(), &subject()).is_err());
    let faults = serde_json::json!({"k1": {"value": 0.1}});
    let own = Upload { reading: Reading::Own { faults: serde_json::from_value(faults).unwrap() }, ..upload() };
    assert_eq!(pointers(&own), ["#/faults"]);
}

#[test]
fn whatever_a_key_follows_from_makes_another_key() {
    let id = key().id();
    let strangers = [
        installation().derive("0123456789abcdee".parse().unwrap(), &Default::default(), &subject()),
        installation().derive(id, &"other".parse().unwrap(), &subject()),
        installation().derive(id, &Default::default(), &wing()),
        InstallationKey::new([7; 32]).derive(id, &Default::default(), &subject()),
        changed(|tail, _, _, _| *tail = "EC-MXB".parse().unwrap()),
        changed(|_, position, _, _| *position = "AIL-R".parse().unwrap()),
        changed(|_, _, serial, _| *serial = "SN-0002".parse().unwrap()),
        changed(|_, _, _, mask| *mask = ContentHash::of(b"another mask")),
    ];
    for stranger in strangers {
        assert_eq!(frame().open(&stranger), Err(FrameError::NotAuthentic), "{}", stranger.reveal());
    }
}

fn changed(
    change: impl Fn(&mut domain::TailNumber, &mut domain::Position, &mut domain::SerialNumber, &mut ContentHash),
) -> FrameKey {
    let mut other = subject();
    if let FrameSubject::Actuator { tail, position, serial_number, mask_id, .. } = &mut other {
        change(tail, position, serial_number, mask_id);
    }
    key_of(&other)
}

#[test]
fn nothing_but_reveal_and_the_card_of_a_key_print_it() {
    let secret = key().reveal();
    let secret = secret.split_once('.').unwrap().1;
    let card = KeyCard { key: key(), operator: Default::default(), subject: subject() };
    for said in [format!("{:?} {card:?} {:?}", key(), installation()), format!("{:?}", frame())] {
        assert!(!said.contains(&secret[..8]), "{said}");
        assert!(!said.contains("00010203"), "{said}");
    }
    let read: KeyCard = serde_json::from_str(&serde_json::to_string(&card).unwrap()).unwrap();
    assert_eq!((read.key.reveal(), read.subject), (key().reveal(), subject()));
    for bad in ["", secret, &key().reveal().to_uppercase(), &format!("{} ", key().reveal())] {
        assert_eq!(bad.parse::<FrameKey>().unwrap_err(), InvalidSecret::Frame);
    }
    let text = (0..32).map(|byte| format!("{byte:02x}")).collect::<String>();
    let same: InstallationKey = text.parse().unwrap();
    assert_eq!(same.derive(key().id(), &Default::default(), &subject()).reveal(), key().reveal());
    assert_eq!(text.to_uppercase().parse::<InstallationKey>().unwrap_err(), InvalidSecret::Installation);
}

#[test]
fn what_is_cut_long_or_of_another_layout_is_told_apart() {
    let whole = frame();
    for length in 0..whole.bytes().len() {
        let told = Frame::parse(&whole.bytes()[..length]).unwrap_err();
        assert!(matches!(told, FrameError::Cut { bytes, .. } if bytes == length), "{told}");
    }
    let longer = [whole.bytes(), &[0]].concat();
    assert_eq!(Frame::parse(&longer), Err(FrameError::Long { bytes: 129, expected: 128 }));
    assert_eq!(Frame::parse_first(&longer), Ok((whole, &[0][..])));
    for layout in (0..=255).filter(|layout| ![ACTUATOR, STRAIN].contains(layout)) {
        assert_eq!(Frame::parse(&[layout; 128]), Err(FrameError::Layout(layout)));
    }
    assert_eq!(from_base32("AB1D"), Err(FrameError::Text { at: 3 }));
    assert!(from_base32("abcd").is_err() && from_base32("ABC").is_err() && from_base32("AB======").is_err());
}

#[test]
fn bits_that_mean_nothing_are_refused_even_by_a_good_mac() {
    let spoil = |at: usize, with: u8| {
        let mut bytes = frame().bytes()[..frame().bytes().len() - MAC].to_vec();
        bytes[at] = with;
        Frame::written(bytes, &key()).open(&key()).unwrap_err().to_string()
    };
    assert!(spoil(42, 0b1110_1000).contains("bits"), "no such ground");
    assert!(spoil(44, 5).contains("bits") && spoil(44, 0x80).contains("bits"), "no such step");
    assert!(spoil(17, 0xfe).contains("#/flight_hours"));
    assert!(spoil(24, 0xfe).contains("#/temperature_c"), "out of range");
    let mut partly = frame().bytes()[..120].to_vec();
    partly[30..32].fill(0xff);
    assert!(Frame::written(partly, &key()).open(&key()).unwrap_err().to_string().contains("#/air_data"));
    let mut missing = frame().bytes()[..120].to_vec();
    missing[17..21].fill(0xff);
    assert!(Frame::written(missing, &key()).open(&key()).unwrap_err().to_string().contains("#/flight_hours"));
}

proptest! {
    #[test]
    fn no_bytes_make_reading_panic(mut bytes in vec(any::<u8>(), 0..300), layout in 0_u8..4) {
        if let Some(first) = bytes.first_mut() { *first = layout; }
        if let Ok((frame, _)) = Frame::parse_first(&bytes) {
            prop_assert!(frame.bytes().len() <= MAX_BYTES);
            prop_assert_eq!(frame.open(&key()), Err(FrameError::NotAuthentic));
            let _ = rows(&frame);
            // What a key writes goes through the same reader.
            let signed = frame.bytes()[..frame.bytes().len() - MAC].to_vec();
            let _ = Frame::written(signed, &key()).open(&key());
        }
        let _ = from_base32(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn no_flipped_bits_are_believed(bits in vec(0_usize..8 * 128, 1..4)) {
        let mut bytes = frame().bytes().to_vec();
        for bit in &bits { bytes[bit / 8] ^= 1 << (bit % 8); }
        prop_assume!(bytes != frame().bytes());
        match Frame::parse(&bytes) {
            Ok(frame) => prop_assert_eq!(frame.open(&key()), Err(FrameError::NotAuthentic)),
            Err(error) => prop_assert!(bits.iter().any(|bit| [0, 42, 43].contains(&(bit / 8))), "{}", error),
        }
    }

    #[test]
    fn what_was_read_is_written_again_as_it_is(
        told in vec(option::of(-0.1_f64..0.1), 0..31),
        mean in option::of(-10.0_f64..10.0),
        hours in 0.0_f64..500_000.0,
        temperature in option::of(-100.0_f64..150.0),
        on_ground in option::of(any::<bool>()),
        counter in any::<u32>(),
    ) {
        let mut sent = upload();
        (samples(&mut sent).samples, samples(&mut sent).load_ratio) = (told, mean.map(LoadRatio::Mean));
        (sent.flight_hours, sent.temperature_c, sent.on_ground) = (hours, temperature, on_ground);
        let measured = Measured::of(&sent, &subject()).unwrap();
        let frame = measured.frame(counter, &key()).unwrap();
        let read = opened(&Frame::parse(frame.bytes()).unwrap());
        prop_assert_eq!(frame.counter(), counter);
        let again = read.frame(counter, &key()).unwrap();
        prop_assert_eq!(&again, &frame);
        prop_assert_eq!(read.on_ground, on_ground);
        prop_assert!((read.flight_hours - hours).abs() <= 0.5e-3 + 1e-9);
        let greatest = measured.samples.iter().flatten().fold(0.0, |most: f64, sample| most.max(sample.abs()));
        for (read, told) in read.samples.iter().zip(&measured.samples) {
            prop_assert_eq!(read.is_some(), told.is_some());
            let (read, told) = (read.unwrap_or_default(), told.unwrap_or_default());
            prop_assert!((read - told).abs() <= greatest / 2046.0 + 1e-12, "{} for {}", read, told);
        }
    }
}

/// The block of the page behind a heading, without its breaks.
fn block(heading: &str) -> String {
    let (_, rest) = PAGE.split_once(&format!("{heading}\n\n```text\n")).expect("the page has it");
    rest.split_once("```").unwrap().0.split_whitespace().collect()
}

#[test]
fn the_example_of_the_page_is_a_frame() {
    let bytes = hex::decode(block("In hexadecimal:")).unwrap();
    assert_eq!(from_base32(&block("In base32:")).unwrap(), bytes);
    let example = Frame::parse(&bytes).unwrap();
    assert_eq!(example, frame());
    assert!(PAGE.contains(&key().reveal()), "{}", key().reveal());
    assert!(PAGE.contains(&(0..32).map(|byte| format!("{byte:02x}")).collect::<String>()));
    let told = opened(&example);
    assert_eq!((told.flight_hours, told.temperature_c, told.samples[7]), (1234.5, Some(-54.25), None));
    let strain = from_base32(&block("And of the strain:")).unwrap();
    assert_eq!(Frame::parse(&strain).unwrap(), strain_frame());
}

#[test]
fn the_page_tells_each_field_by_its_place_range_and_step() {
    use super::field::*;
    let all = [FLIGHT_HOURS, FLIGHT_CYCLES, TEMPERATURE, WINDING, NOISE].into_iter().chain(AIR);
    for Field { pointer, at, width, range, per_unit } in all {
        let (name, step) = (pointer.trim_start_matches("#/").replace('/', "."), 1.0 / per_unit);
        let row = format!("| {at} | {width} | `{name}` | {} to {} | {step} | {} |", range.min, range.max, range.unit);
        assert!(PAGE.contains(&row), "{row}");
    }
    for (at, row) in rows(&frame()).unwrap().into_iter().enumerate().skip(3) {
        assert!(PAGE.contains(&format!("| {} | ", row.at)), "{at}: {row:?}");
    }
}
