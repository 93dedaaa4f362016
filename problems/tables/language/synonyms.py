"""Synonyms of column names in English, German, French and Spanish, the most certain first."""

from collections.abc import Mapping


def words(text: str) -> frozenset[str]:
    """Return the texts in a comma-separated list."""
    return frozenset(text.split(", "))


Synonyms = Mapping[str, tuple[str, ...]]
"""Comma-separated lists of names for each field; names in earlier lists rank first."""

PLACES: Synonyms = {
    "x": ("x", "pos x, position x, x position, x coordinate, coord x, easting, rechtswert"),
    "y": ("y", "pos y, position y, y position, y coordinate, coord y, northing, hochwert"),
    "z": (
        "z",
        "pos z, position z, z position, z coordinate, coord z, alt, altitude, elevation, height, hohe, hoehe, "
        "hauteur, altura, altitud",
    ),
    "lat": ("lat", "latitude, breite, breitengrad, latitud, gps lat, gps latitude, geo lat, position lat"),
    "lon": (
        "lon",
        "lng, long, longitude, lange, laenge, langengrad, laengengrad, longitud, gps lon, gps lng, gps long, gps "
        "longitude, geo lon, position lon",
    ),
    "gps": (
        "gps",
        "lat lon, lat lng, lat long, latlon, latlng, latitude longitude, gps position, gps coordinates, gps "
        "koordinaten",
    ),
    "lonlat": ("lon lat", "lng lat, long lat, lonlat, longitude latitude"),
    "position": ("position", "xy, x y, xyz, x y z"),
}

AGENTS: Synonyms = {
    "id": (
        "id",
        "name, agent, drone, uav, robot, vehicle, truck, van, crew, worker, machine, employee, person, callsign, "
        "drohne, roboter, fahrzeug, maschine, gerat, geraet, mitarbeiter, bezeichnung, kennung, nom, identifiant, "
        "vehicule, nombre, identificador, vehiculo, dron",
        "team, no, nr, number, nummer, numero, code, label",
    ),
    "ability": (
        "ability",
        "capacity, payload, rate, work rate, strength, throughput, performance, productivity, load, payload "
        "capacity, carrying capacity, load capacity, kapazitat, kapazitaet, leistung, nutzlast, traglast, "
        "zuladung, fahigkeit, faehigkeit, capacite, charge utile, debit, puissance, capacidad, carga util, "
        "rendimiento",
    ),
    "battery": (
        "battery",
        "battery capacity, battery level, battery energy, energy, energy budget, akku, akkukapazitat, batterie, "
        "batteriekapazitat, energie, bateria, energia",
    ),
    "range": (
        "range",
        "communication range, comm range, radius, max distance, maximum distance, reichweite, portee, autonomie, "
        "rayon, alcance, autonomia",
    ),
    "speed": (
        "speed",
        "velocity, cruise speed, flight speed, travel speed, "
        "top speed, vmax, geschwindigkeit, geschw, tempo, vitesse, velocidad",
    ),
    "energy_per_distance": (
        "energy per distance",
        "consumption, energy consumption, energy use, energy usage, fuel use, fuel consumption, verbrauch, "
        "energieverbrauch, consommation, consumo",
    ),
    "start_task": ("start task", "starts at, current task, initial task, startaufgabe"),
    "tasks": ("tasks", "allowed tasks, eligible tasks, possible tasks, may do, can do, aufgaben, taches, tareas"),
    "skills": (
        "skills",
        "skill, capabilities, qualifications, qualification, certificates, equipment, sensors, tools, "
        "fahigkeiten, faehigkeiten, qualifikation, qualifikationen, ausrustung, competences, equipement, "
        "habilidades, competencias, equipo",
    ),
    "returns": (
        "returns",
        "return, returns to, round trip, return home, return to base, returns to base, return base, home base, rth, "
        "ruckkehr, rueckkehr, ruckflug, retour, regreso",
    ),
    **PLACES,
}

BASES: Synonyms = {
    "id": (
        "id",
        "name, base, depot, airfield, station, home, hub, site, bezeichnung, basis, standort, nom, nombre",
        "no, nr, number, nummer, numero, code, label",
    ),
    **PLACES,
}

TASKS: Synonyms = {
    "id": (
        "id",
        "name, task, job, order, mission, target, site, customer, client, stop, auftrag, aufgabe, einsatz, kunde, "
        "ziel, bezeichnung, nom, tache, identifiant, nombre, tarea, pedido, cliente",
        "no, nr, number, nummer, numero, code, label",
    ),
    "workload": (
        "workload",
        "load, demand, work, effort, amount, quantity, qty, volume, size, weight, area, man hours, person hours, "
        "arbeitslast, arbeit, aufwand, bedarf, menge, umfang, last, flache, gewicht, charge, charge de travail, "
        "travail, demande, quantite, carga, carga de trabajo, trabajo, demanda, cantidad, esfuerzo",
    ),
    "priority": (
        "priority",
        "prio, urgency, importance, weight, prioritat, prioritaet, dringlichkeit, gewicht, priorite, urgence, "
        "prioridad, urgencia",
    ),
    "needs": (
        "needs",
        "need, needed skills, required skills, requires, requirements, required, skills, skill, equipment, "
        "benotigt, braucht, erfordert, anforderungen, besoins, competences, requisitos",
    ),
    **PLACES,
}

DISTANCES: Synonyms = {
    "from": ("from", "source, origin, start, agent, von, de, desde, origine, origen"),
    "to": ("to", "target, destination, task, end, nach, zu, bis, vers, a, hasta, ziel, destino"),
    "distance": (
        "distance",
        "dist, length, km, m, road distance, entfernung, distanz, strecke, weg, longueur, distancia",
    ),
}

KINDS = {
    "agents": "agent, drone, uav, robot, vehicle, truck, van, crew, worker, machine, employee, team, unit, fahrzeug, "
    "drohne, drohnen",
    "tasks": "task, job, order, mission, target, site, customer, stop, auftrag, aufgabe",
    "bases": "base, depot, airfield, station, hub",
}
"""Words for agents, tasks and bases; `drone_id` and `Drone No.` are ids of agents."""

UNCLEAR_PLACES = words(
    "location, coordinates, coordinate, coords, koordinaten, coordonnees, coordenadas, standort, ort, lage, place, "
    "ubicacion, emplacement"
)
"""Columns that may contain latitude and longitude, x and y, or a name."""

TOTALS = words(
    "total, totals, grand total, sum, sum total, overall, summe, gesamt, gesamtsumme, insgesamt, somme, "
    "total general, total generale, suma, average, mean, mittelwert, durchschnitt, mittel, moyenne, promedio, media, "
    "count, anzahl, nombre total, \u2211, \u03c3, \u00f8"
)
"""Names of the row of a total or a mean below the others."""

LEVELS = {
    "lowest": 0.5, "low": 1.0, "minor": 1.0, "niedrig": 1.0, "gering": 1.0, "basse": 1.0, "baja": 1.0,
    "normal": 2.0, "medium": 2.0, "standard": 2.0, "mittel": 2.0, "moyenne": 2.0, "media": 2.0,
    "high": 3.0, "hoch": 3.0, "haute": 3.0, "alta": 3.0, "urgent": 4.0, "critical": 4.0, "highest": 4.0,
    "dringend": 4.0, "kritisch": 4.0, "urgente": 4.0,
}  # fmt: skip
"""Priorities given as words."""

FIRST_IS_HIGHEST = (
    r"\b1\s*(?:=|is|:|ist)\s*(?:the |most |very )*(?:urgent|high|top|first|hoch|hö|dring|sehr|haut|alt|prior)"
)
"""Pattern of a header of priorities in which small numbers are most urgent."""

YES = words("yes, y, true, 1, x, ja, j, wahr, oui, o, vrai, si, sí, s, verdadero, \u2713, \u2714, on")
NO = words("no, n, false, 0, nein, falsch, non, faux, falso, \u2717, \u2718, -, off")
