import pytest

from bimvox.errors import ConfigError
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.site_config import SiteConfig


def read(text: str) -> SiteConfig:
    return parse_site_config(f'[model]\npath = "a.ifc"\n[calendar]\n{text}', "site.toml")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('country = "XX"', "country: no holidays are known of 'XX'; use its ISO code, such as DE"),
        ('country = "DE"\nregion = "ZZ"', "region: no holidays are known of 'ZZ' in DE; known: BB, BE, BW"),
        ('region = "BY"', "region: give the country too"),
        ('start = "2026-03-09"', "calendar.start: expected a date such as 2026-03-09, without quotes"),
        ("start = 2026-03-09T07:00:00", "calendar.start: expected a date such as 2026-03-09"),
        ("start = 9999-01-01", "calendar.start: 9999-01-01 is not between 1950 and 2150"),
        ('shifts = ["7-16"]', r"calendar.shifts\[0\]: expected two times such as 07:00-16:00, got '7-16'"),
        ('shifts = ["07:00-25:00"]', r"calendar.shifts\[0\]: '25:00' is not a time of day"),
        ('shifts = ["06:00-14:00", "13:00-22:00"]', "shifts: 06:00-14:00 and 13:00-22:00 overlap"),
        ('shifts = ["22:00-06:00", "05:00-13:00"]', "shifts: 22:00-06:00 and 05:00-13:00 overlap"),
        ('breaks = ["17:00-18:00"]', "breaks: 17:00-18:00 is not within a shift"),
        ('breaks = ["07:00-16:00"]', "breaks: they leave no time to work"),
        ('days = ["Mo"]', r"calendar.days\[0\]: input should be 'Mon'"),
        ("setup_h = -1", "calendar.setup_h: input should be greater than or equal to 0"),
    ],
)
def test_what_cannot_be_is_named(text: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        read(text)


def test_shifts_may_adjoin_and_go_over_midnight() -> None:
    hours = read('shifts = ["14:00-22:00", "22:00-06:00"]\nbreaks = ["02:00-02:30"]').calendar.hours
    assert hours.spans == ((840, 1320), (1320, 1560), (1590, 1800))
    assert hours.of_weekday(0) == ((840, 1320), (1320, 1440))
    assert hours.of_weekday(5) == ((0, 120), (150, 360))


def test_the_default_says_what_it_is() -> None:
    calendar = read("").calendar
    assert calendar.is_default
    assert calendar.begins is None
    assert calendar.in_words() == (
        "Mon to Fri 07:00-16:00, breaks 09:00-09:15 and 12:00-12:45, no public holidays, "
        "wind takes 15.5 working days a year (assumed), set-up of the crane 0 h, "
        "unloading of a lorry 30 min, erection crew of 3 (assumed)"
    )
    assert read("erection_people = 3").calendar.in_words().endswith("erection crew of 3")
    assert read('shifts = ["13:00-17:00"]').calendar.hours.spans == ((780, 1020),)
