"""Wind and its disturbances, weather and time of a scenario: their ranges, and the requests they become."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Tuple

Ranges = Mapping[str, Tuple[float, float]]

#: Of set_wind; what is not given is calm air from north.
WIND: Ranges = {"speed": (0.0, 100.0), "from_deg": (0.0, 360.0), "turbulence": (0.0, 1.0)}
#: Of disturb, by kind; what a scenario must give stands in `DISTURBANCE_NEEDS`.
DISTURBANCES: Mapping[str, Ranges] = {
    "gust": {
        "duration": (0.0, 36000.0),
        "from_deg": (0.0, 360.0),
        "speed": (0.0, 50.0),
        "vertical_speed": (-50.0, 50.0),
        "length": (0.0, 20000.0),
    },
    "turbulence": {
        "duration": (0.0, 36000.0),
        "from_deg": (0.0, 360.0),
        "speed": (0.001, 50.0),
        "seed": (0.0, 4294967295.0),
    },
    "shear": {
        "duration": (0.0, 36000.0),
        "from_deg": (0.0, 360.0),
        "speed": (0.0, 50.0),
        "gradient": (-1.0, 1.0),
        "roughness": (0.0, 2.0),
    },
    "microburst": {
        "duration": (0.0, 36000.0),
        "speed": (0.001, 50.0),
        "latitude": (-90.0, 90.0),
        "longitude": (-180.0, 180.0),
        "radius": (100.0, 10000.0),
        "height": (10.0, 1000.0),
    },
    "stop": {},
}
DISTURBANCE_NEEDS: Mapping[str, Tuple[str, ...]] = {
    "gust": (),
    "turbulence": ("speed",),
    "shear": (),
    "microburst": ("speed", "latitude", "longitude", "radius", "height"),
    "stop": (),
}
#: Of set_time, each with its bit of `fields`.
TIME: Ranges = {"date_days": (0.0, 365.0), "zulu_time": (0.0, 86400.0), "time_ratio": (1.0, 16.0)}
_TIME_BITS = {"date_days": "DATE", "zulu_time": "ZULU_TIME", "time_ratio": "TIME_RATIO"}
#: Of a wind layer and of a cloud layer; altitude, speed, base and top must be given.
WIND_LAYER: Ranges = {
    "altitude": (-500.0, 30000.0),
    "from_deg": (0.0, 360.0),
    "speed": (0.0, 100.0),
    "shear": (0.0, 100.0),
    "turbulence": (0.0, 1.0),
}
CLOUD_LAYER: Ranges = {"base": (-500.0, 30000.0), "top": (-500.0, 30000.0), "cover": (0.0, 1.0), "type": (0.0, 5.0)}
#: The layers of set_weather, with what each of them must have.
LAYERS: Mapping[str, Tuple[Ranges, Tuple[str, ...]]] = {
    "wind": (WIND_LAYER, ("altitude", "from_deg", "speed")),
    "clouds": (CLOUD_LAYER, ("base", "top", "cover")),
}
#: Its numbers.
WEATHER: Ranges = {
    "visibility": (10.0, 200000.0),
    "precipitation": (0.0, 1.0),
    "sea_level_temperature": (-60.0, 60.0),
    "sea_level_pressure": (85000.0, 110000.0),
}
_WEATHER_BITS = {
    "wind": "WIND",
    "clouds": "CLOUDS",
    "visibility": "VISIBILITY",
    "precipitation": "PRECIPITATION",
    "sea_level_temperature": "TEMPERATURE",
    "sea_level_pressure": "PRESSURE",
}
#: Which of all these are whole numbers.
WHOLE = ("seed", "date_days", "time_ratio", "type")
#: Kinds of actions that take tx_node's services, or an X-Plane: nothing that flies in process has them.
KINDS = ("reset", "wind", "disturb", "weather", "time", "traffic")


def wind_request(value: Mapping[str, float]) -> Dict[str, float]:
    """Fields of SetWind. North is 360 deg, also of calm air: the service takes three zeros for nothing."""
    return {"speed": 0.0, "turbulence": 0.0, **value, "from_deg": value.get("from_deg") or 360.0}


def disturbance_request(value: Mapping[str, Any]) -> Dict[str, Any]:
    """Fields of SetDisturbance."""
    return {key: int(given) if key in WHOLE else given for key, given in value.items()}


def time_request(value: Mapping[str, float], bits: Any) -> Dict[str, Any]:
    """Fields of SetTime; `bits` has its constants."""
    fields = {key: int(number) if key in WHOLE else number for key, number in value.items()}
    return {"fields": sum(getattr(bits, _TIME_BITS[key]) for key in value), **fields}


def weather_request(value: Mapping[str, Any], bits: Any) -> Dict[str, Any]:
    """Fields of SetWeather; `bits` has its constants."""
    request: Dict[str, Any] = {"fields": sum(getattr(bits, _WEATHER_BITS[key]) for key in value)}
    for key, given in value.items():
        if key == "wind":
            for name in WIND_LAYER:
                request[f"wind_layer_{name}"] = [layer.get(name, 0.0) for layer in given]
        elif key == "clouds":
            for name in CLOUD_LAYER:
                numbers = [layer.get(name, 0.0) for layer in given]
                request[f"cloud_{name}"] = [int(number) for number in numbers] if name in WHOLE else numbers
        else:
            request[key] = given
    return request
