"""Realistic spreadsheets with the expected result of each: an instance, or one line that says what to correct."""

import io
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from alloc.problems import Units

Rows = list[list[object]]
Content = str | bytes | Rows

INF = float("inf")


@dataclass(frozen=True)
class Case:
    """Tables, options of the import, and the fields of the instance or the error."""

    name: str
    agents: Content = "id,ability\na1,4\na2,2\n"
    tasks: Content = "id,workload\nt1,5\nt2,7\n"
    distances: Content | None = None
    bases: Content | None = None
    options: dict[str, object] = field(default_factory=dict)
    fields: dict[str, object] = field(default_factory=dict)
    error: str = ""
    lines: tuple[str, ...] = ()
    merged: tuple[str, ...] = ()
    sheet: str = ""

    def write(self, folder: Path) -> tuple[str, str, str | None, str | None]:
        """Write the tables, and return their paths."""
        distances = None if self.distances is None else _write(folder / "distances", self.distances)
        return (
            _write(folder / "agents", self.agents, self.merged, self.sheet),
            _write(folder / "tasks", self.tasks),
            distances,
            None if self.bases is None else _write(folder / "bases", self.bases),
        )


def _write(stem: Path, content: Content, merged: tuple[str, ...] = (), sheet: str = "") -> str:
    if isinstance(content, list):
        path = stem.with_suffix(".xlsx")
        path.write_bytes(workbook(content, merged, sheet))
        return f"{path}:{sheet}" if sheet else str(path)
    path = stem.with_suffix(".csv")
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return str(path)


def workbook(rows: Rows, merged: tuple[str, ...] = (), sheet: str = "") -> bytes:
    """Return a workbook; with the name of a sheet, that is the second, behind one with remarks."""
    import openpyxl

    book = openpyxl.Workbook()
    page = book.active
    if sheet:
        page.append(["Remarks"])
        page = book.create_sheet(sheet)
    for row in rows:
        page.append(row)
    for block in merged:
        page.merge_cells(block)
    data = io.BytesIO()
    book.save(data)
    return data.getvalue()


SEPARATORS_AND_ENCODINGS = [
    Case("commas", "id,ability\nd1,4\nd2,2.5\n", fields={"agent_ids": ("d1", "d2"), "ability": [4, 2.5]}),
    Case("semicolons", "id;ability\nd1;4\nd2;2,5\n", fields={"ability": [4, 2.5]}),
    Case("tabs", "id\tability\nd1\t4\nd2\t2,5\n", fields={"ability": [4, 2.5]}),
    Case("bars", "id|ability\nd1|4\nd2|2.5\n", fields={"ability": [4, 2.5]}),
    Case("sep line of Excel", "sep=;\r\nid;ability\r\nd1;4\r\nd2;2,5\r\n", fields={"ability": [4, 2.5]}),
    Case(
        "semicolons, and commas in every number",
        "id;ability;speed\nd1;1,5;2,5\nd2;3,5;4,5\n",
        fields={"ability": [1.5, 3.5], "speed": [2.5, 4.5]},
    ),
    Case(
        "commas, and semicolons in lists",
        "id,ability,tasks\nd1,4,t1;t2\nd2,2,t2;t1\nd3,1,t1\n",
        fields={"allowed_tasks": [[0, 1], [0, 1], [0]]},
    ),
    Case("byte order mark", "\ufeffid;ability\nd1;4\n", fields={"agent_ids": ("d1",)}),
    Case("UTF-16 with mark", "id\tability\nJosé\t4\n".encode("utf-16"), fields={"agent_ids": ("José",)}),
    Case("UTF-16 without mark", "id\tability\nd1\t4\n".encode("utf-16-le"), fields={"agent_ids": ("d1",)}),
    Case(
        "Latin-1",
        "Bezeichnung;Fähigkeit\nMüller;4\n".encode("latin-1"),
        fields={"agent_ids": ("Müller",), "ability": [4]},
        lines=("agents.csv: is not UTF-8 and was read as Windows-1252",),
    ),
    Case("line ends of an old Mac", "id,ability\rd1,4\rd2,2\r", fields={"ability": [4, 2]}),
    Case("quoted cells with commas", '"id","ability"\n"Smith, J.","4"\n', fields={"agent_ids": ("Smith, J.",)}),
    Case("line break in a cell", 'id,ability\n"d\n1",4\n', fields={"agent_ids": ("d 1",)}),
    Case("text that Excel must not take for a number", 'id,ability\n="007",4\n', fields={"agent_ids": ("007",)}),
    Case(
        "a page of HTML",
        "<html><table><tr><td>id</td></tr></table></html>",
        error="agents.csv: is HTML, XML or JSON, not a table; save it as .csv or .xlsx",
    ),
    Case(
        "open quote",
        'id,ability\n"d1,4\nd2,3\n',
        error="agents.csv: line 2: has a cell that cannot be read: unexpected end of data; are its quotes balanced?",
    ),
    Case("no text", b"\x89PNG\x00\x1a\n" + b"abcdef" * 5, error="agents.csv: is not text; save it as .csv or .xlsx"),
    Case("empty file", "", error="agents.csv: is empty; it needs a row with the names of its columns, and rows below"),
]

NUMBERS = [
    Case("thousands with points", "id;ability\nd1;1.234,5\nd2;2.000,25\n", fields={"ability": [1234.5, 2000.25]}),
    Case("thousands with commas", 'id,ability\nd1,"1,234.5"\nd2,"12,000,000"\n', fields={"ability": [1234.5, 12e6]}),
    Case("thousands with blanks", "id;ability\nd1;1 234,5\nd2;2\u00a0000\n", fields={"ability": [1234.5, 2000]}),
    Case("thousands with apostrophes", "id;ability\nd1;1'234.5\nd2;2’000\n", fields={"ability": [1234.5, 2000]}),
    Case(
        "one comma that may be either",
        'id,ability\nd1,"1,234"\nd2,7\n',
        error="agents.csv: line 2, column 'ability': '1,234' may be 1.234 or 1234;"
        " specify it by --decimal comma or --decimal point",
    ),
    Case(
        "one point that may be either, between semicolons",
        "id;ability\nd1;1.234\nd2;7\n",
        error="agents.csv: line 2, column 'ability': '1.234' may be 1.234 or 1234;"
        " specify it by --decimal point or --decimal comma",
    ),
    Case(
        "whole numbers and one that may be thousands",
        tasks="Job,Area\nRoof,120\nYard,1.000\n",
        error="tasks.csv: line 3, column 'Area': '1.000' may be 1.000 or 1000;"
        " specify it by --decimal point or --decimal comma",
    ),
    Case("one point between commas", "id,ability\nd1,1.234\n", fields={"ability": [1.234]}),
    Case("the user says comma", "id;ability\nd1;1,234\n", options={"decimal": "comma"}, fields={"ability": [1.234]}),
    Case("the user says point", "id;ability\nd1;1,234\n", options={"decimal": "point"}, fields={"ability": [1234]}),
    Case(
        "another number of the column decides",
        "id;ability\nd1;1,234\nd2;0,5\n",
        fields={"ability": [1.234, 0.5]},
    ),
    Case(
        "another column decides",
        "id;ability;speed\nd1;1.234;2,75\n",
        fields={"ability": [1234], "speed": [2.75]},
    ),
    Case(
        "both marks in one column",
        "id;ability\nd1;1,5\nd2;2.5\n",
        error="agents.csv: column 'ability': has decimal commas and decimal points; use one of them",
    ),
    Case("exponents and a plus", "id,ability\nd1,1e3\nd2,+2.5E-1\n", fields={"ability": [1000, 0.25]}),
    Case("units behind numbers", "id;ability\nd1;4 kg\nd2;2,5kg\n", fields={"ability": [4, 2.5], "units.work": "kg"}),
    Case(
        "two units behind numbers",
        "id;ability\nd1;4 kg\nd2;2 t\n",
        error="agents.csv: line 3, column 'ability': is in t, others are in kg; use one unit",
    ),
    Case(
        "no number",
        "id,ability\nd1,four\n",
        error="agents.csv: line 2, column 'ability': must be a number, got 'four'",
    ),
    Case(
        "a name taken for something else",
        "Gerät;Rate\nM 1;schnell\n",
        error="agents.csv: line 2, column 'Rate': must be a number, got 'schnell'; if this is not the ability, specify "
        "it by --map ability=COLUMN",
    ),
    Case("devices", "Gerät;Rate\nM 1;4\n", fields={"agent_ids": ("M 1",), "ability": [4]}),
    Case(
        "no ability",
        "id,ability\nd1,4\nd2,\n",
        error="agents.csv: line 3, column 'ability': has no ability; fill it in, or leave the row out",
    ),
    Case(
        "no limits",
        "id,ability,battery,range\nd1,4,n/a,-\nd2,2,20,unlimited\n",
        fields={"battery": [INF, 20], "communication_range": [INF, INF]},
    ),
    Case(
        "negative ability",
        "id,ability\nd1,4\nd2,−3\n",
        error="agents.csv: line 3: must be a finite number > 0, got -3 (agent 'd2')",
    ),
    Case(
        "decimal commas between commas",
        "id,ability\nd1,1,5\nd2,2,5\n",
        error="agents.csv: line 2: has 3 cells, but there are names for 2 columns;"
        " name each column, and put numbers with decimal commas into quotes",
    ),
    Case(
        "error of a formula",
        "id,ability\nd1,#REF!\n",
        error="agents.csv: line 2, column 'ability': contains the error '#REF!' of a formula; correct it",
    ),
]

HEADERS = [
    Case(
        "capital letters, blanks and underscores",
        " ID ,ABILITY, Start_Task \nd1,4,t2\n",
        fields={"agent_ids": ("d1",), "start_task": [1]},
    ),
    Case(
        "words of the trade",
        "Drone,Payload kg,Cruise Speed (km/h),Battery [Wh]\nd1,4,50,900\n",
        "Site,Demand (kg),Prio\ns1,5,2\n",
        fields={
            "agent_ids": ("d1",),
            "ability": [4],
            "speed": [50],
            "battery": [900],
            "task_ids": ("s1",),
            "workload": [5],
            "priority": [2],
            "units.energy": "Wh",
            "units.time": "h",
            "units.distance": "km",
            "units.work": "kg",
        },
        lines=(
            "agents.csv: Drone -> id",
            "agents.csv: Payload kg -> ability",
            "tasks.csv: Prio -> priority (larger is more urgent)",
        ),
    ),
    Case(
        "German",
        "Drohne;Leistung;Geschwindigkeit;Reichweite;Fähigkeiten;Rückkehr\nA;3,5;40;12,5;Kamera, Wärme;ja\n",
        "Auftrag;Aufwand;Priorität;Benötigt\nB;7;hoch;kamera\n",
        fields={
            "agent_ids": ("A",),
            "speed": [40],
            "communication_range": [12.5],
            "returns": [True],
            "skills": (("Kamera", "Wärme"),),
            "needs": (("Kamera",),),
            "priority": [3],
        },
    ),
    Case(
        "French",
        "Nom;Capacité;Vitesse;Autonomie\nA;3,5;40;12,5\n",
        "Tâche;Charge;Priorité\nB;7;2\n",
        fields={"ability": [3.5], "speed": [40], "communication_range": [12.5], "workload": [7], "priority": [2]},
    ),
    Case(
        "Spanish",
        "Nombre;Capacidad;Velocidad\nA;3,5;40\n",
        "Tarea;Carga;Prioridad\nB;7;2\n",
        fields={"ability": [3.5], "speed": [40], "workload": [7], "priority": [2]},
    ),
    Case("camel case", "droneId,workRate\nd1,4\n", fields={"agent_ids": ("d1",), "ability": [4]}),
    Case(
        "further columns",
        "id,ability,Colour,Comment\nd1,4,red,\n",
        fields={"ability": [4]},
        lines=("agents.csv: Colour: ignored", "agents.csv: Comment: ignored"),
    ),
    Case(
        "title and empty rows above",
        "Fleet of May 2026;;\n;;\nid;ability;speed\nd1;4;30\n",
        fields={"ability": [4], "speed": [30]},
    ),
    Case("row of units", "id;speed;ability\n;km/h;kg\nd1;30;4\n", fields={"units.work": "kg", "speed": [30]}),
    Case(
        "row of units with dashes",
        "Drone;Speed;Payload\n-;[m/s];[kg]\nA;5;6\n",
        fields={"units.work": "kg", "agent_ids": ("A",), "speed": [5 * 3600], "units.distance": "m"},
    ),
    Case(
        "all that a German operator knows",
        "lfd.;Drohnen-ID;Traglast (kg);Max. Geschwindigkeit (m/s);Akkukapazität (Wh);Verbrauch (Wh/km)\n"
        "1;D-01;2,5;15;500;20\n2;D-02;5;12;800;35\n",
        "Aufgabe;Last (kg);Priorität;Breitengrad;Längengrad\nA;12,5;1;48,13;11,57\nB;7;2;48,2;11,6\nGesamt;19,5;;;\n",
        fields={
            "agent_ids": ("D-01", "D-02"),
            "ability": [2.5, 5],
            "speed": [54, 43.2],
            "battery": [500, 800],
            "agent_energy_per_distance": [20, 35],
            "task_ids": ("A", "B"),
            "task_position": [[11.57, 48.13, 0], [11.6, 48.2, 0]],
        },
        lines=("agents.csv: lfd.: ignored",),
    ),
    Case(
        "two speeds",
        "id,ability,Max speed,Cruise speed\na,1,30,20\n",
        error="agents.csv: columns 'Max speed' and 'Cruise speed' may each be the speed;"
        " specify one, as by --map speed='Max speed'",
    ),
    Case(
        "no header",
        "d1,4\nd2,2\n",
        error="agents.csv: line 1: has no names of columns; write them into the first row, such as id, x, y",
    ),
    Case(
        "two columns for the ability",
        "id,Payload,Capacity\nd1,4,5\n",
        error="agents.csv: columns 'Payload' and 'Capacity' may each be the ability;"
        " specify one, as by --map ability=Payload",
    ),
    Case(
        "two columns for the ability, and the user's choice",
        "id,Payload,Capacity\nd1,4,5\n",
        options={"columns": {"ability": "capacity"}},
        fields={"ability": [5]},
        lines=("agents.csv: Payload: ignored",),
    ),
    Case(
        "the field's own name comes before other names",
        "id,Capacity,Ability\nd1,4,5\n",
        fields={"ability": [5]},
        lines=("agents.csv: Capacity: ignored",),
    ),
    Case(
        "weight of a task",
        tasks="id,weight\nt1,5\n",
        error="tasks.csv: column 'weight': may be the workload or the priority;"
        " specify it by --map workload=weight or --map priority=weight",
    ),
    Case("weight of a task in kg", tasks="id,weight [kg]\nt1,5\n", fields={"workload": [5]}),
    Case(
        "unknown name of the ability",
        "id,zing\nd1,4\n",
        error="agents.csv: no column is recognised as the ability; the columns are 'id', 'zing';"
        " specify it by --map ability=Capacity, or ability=1 for all alike",
    ),
    Case("all abilities alike", "id\nd1\nd2\n", options={"columns": {"ability": "1"}}, fields={"ability": [1, 1]}),
    Case(
        "the user's choice is not there",
        options={"columns": {"ability": "abilty"}},
        error="agents.csv: there is no column 'abilty' (did you mean 'ability'?)",
    ),
    Case(
        "the same header twice",
        "id,ability,ability\nd1,4,5\n",
        error="agents.csv: there are 2 columns 'ability'; rename all but one",
    ),
]

ROWS = [
    Case(
        "totals, in three languages",
        "id;ability\nd1;4\nd2;2\nSumme;6\n",
        "id;workload\nt1;5\nTotal:;5\n",
        fields={"agent_ids": ("d1", "d2"), "task_ids": ("t1",)},
        lines=("agents.csv: line 4 is a total ('Summe') and is left out",),
    ),
    Case(
        "total without a name",
        "id,ability\nd1,4\nd2,2\n,6\n",
        error="agents.csv: line 4: has no id and looks like the sum of the rows above;"
        " call it 'Total', or give it an id",
    ),
    Case("empty rows", "id,ability\n\nd1,4\n,,\nd2,2\n\n\n", fields={"ability": [4, 2]}),
    Case(
        "remark at the end",
        "id,ability\nd1,4\nd2,2\n\nAs of 3 May\n",
        fields={"ability": [4, 2]},
        lines=("agents.csv: line 5 is a remark ('As of 3 May') and is left out",),
    ),
    Case(
        "names of columns again on the second page",
        "id,ability\nd1,4\nid,ability\nd2,2\n",
        fields={"ability": [4, 2]},
        lines=("agents.csv: line 3 repeats the names of the columns and is left out",),
    ),
    Case(
        "the same id twice",
        "id,ability\nd1,4\nd2,2\nd1,3\n",
        error="agents.csv: line 4, column 'id': 'd1' is also the id in line 2; rename one",
    ),
    Case(
        "a row without id",
        "id,ability\nd1,4\n,2\nd3,5\n",
        fields={"agent_ids": ("d1", "a2", "d3")},
        lines=("agents.csv: line 3 has no id and is named a2",),
    ),
    Case(
        "no ids",
        "ability\n4\n2\n",
        fields={"agent_ids": ("a1", "a2")},
        lines=("agents.csv: there is no column of ids: the agents are a1 to a2",),
    ),
    Case("no rows", "id,ability\n", error="agents.csv: has no rows below the names of its columns"),
    Case("ids with leading zeros", "No.,ability\n007,4\n008,2\n", fields={"agent_ids": ("007", "008")}),
]

VALUES = [
    Case(
        "yes and no in many words",
        "id,ability,Round trip\na,1,yes\nb,1,x\nc,1,\nd,1,No\ne,1,TRUE\nf,1,0\n",
        fields={"returns": [True, True, False, False, True, False]},
    ),
    Case(
        "neither yes nor no",
        "id,ability,returns\na,1,maybe\n",
        error="agents.csv: line 2, column 'returns': must be yes, no or the id of a base, got 'maybe'; "
        "give the bases with --bases",
    ),
    Case(
        "lists with bars, in other letters",
        "id,ability,skills\na,1,Camera|Thermal camera\n",
        "id,workload,needs\nt1,5,thermal camera\n",
        fields={"skills": (("Camera", "Thermal camera"),), "needs": (("Thermal camera",),)},
    ),
    Case(
        "lists with blanks",
        "id;ability;skills\na;1;camera winch\n",
        "id;workload;needs\nt1;5;winch\n",
        fields={"skills": (("camera", "winch"),), "needs": (("winch",),)},
    ),
    Case(
        "lists with other marks here than there",
        "id;ability;skills\na;1;camera | heavy lift\n",
        'id,workload,needs\nt1,5,"heavy lift, camera"\n',
        fields={"skills": (("camera", "heavy lift"),), "needs": (("camera", "heavy lift"),)},
    ),
    Case(
        "a skill that nobody has",
        "id;ability;skills\na;1;camera\n",
        "id;workload;needs\nt1;5;cmera\n",
        fields={"needs": (("cmera",),)},
        lines=("no agent has the skill 'cmera', which tasks need",),
    ),
    Case(
        "a task that there is not",
        "id;ability;tasks\na;1;t1, t9\n",
        error="agents.csv: line 2, column 'tasks': there is no task 't9' (known: t1, t2)",
    ),
    Case("priorities in words", tasks="id,workload,Priority\nt1,5,high\nt2,7,Low\n", fields={"priority": [3, 1]}),
    Case(
        "priorities that count from the most urgent",
        tasks="id,workload,Prio (1 = urgent)\nt1,5,1\n",
        error="tasks.csv: column 'Prio (1 = urgent)': counts from 1, the most urgent,"
        " but here larger is more urgent; reverse it",
    ),
    Case(
        "m/s",
        "id,ability,speed_mps\na,1,10\n",
        fields={"speed": [36], "units.time": "h"},
        lines=("agents.csv: speed_mps -> speed in km/h, times 3.6",),
        tasks="id,workload,lat,lon\nt1,5,60,10\n",
    ),
    Case(
        "m/s, with abilities per minute and places in m",
        "id,ability [panels/min],Speed (m/s),x [m],y [m]\na,1,10,0,0\n",
        "id,panels [panels],Panels to clean\nt1,5,5\n",
        options={"columns": {"workload": "panels [panels]"}},
        fields={"speed": [600], "units.time": "min", "units.distance": "m", "units.work": "panels"},
    ),
    Case(
        "consumption in Wh/km and battery in kWh",
        "id,ability,Battery (kWh),Consumption [Wh/km]\na,1,2,50\n",
        fields={"battery": [2000], "agent_energy_per_distance": [50], "units.energy": "Wh"},
    ),
    Case(
        "units that cannot be turned into each other",
        "id,ability [kg/h]\na,1\n",
        "id,workload [m2]\nt1,5\n",
        error="tasks.csv: column 'workload [m2]': is in m2, but work elsewhere in kg,"
        " which cannot be converted; use one unit",
    ),
    Case(
        "consumption in W",
        "id,ability,Consumption (W)\na,1,30\n",
        error="agents.csv: column 'Consumption (W)': is in W, which is not a unit of energy; map another column",
    ),
    Case(
        "an unknown unit of speed",
        "id,ability,Speed [furlongs/h]\na,1,30\n",
        error="agents.csv: column 'Speed [furlongs/h]': is in furlongs, which is not a unit of distance;"
        " map another column",
    ),
    Case(
        "battery in minutes",
        "id,ability,Battery (min)\na,1,30\n",
        error="agents.csv: column 'Battery (min)': is in min, which is not a unit of energy; map another column",
    ),
]

PLACES = [
    Case(
        "x, y and z",
        "id;ability;X;Y;Z\na;1;0,5;1,25;0\nb;1;;;\n",
        fields={"agent_position": [[0.5, 1.25, 0], [None] * 3], "metric": "euclidean"},
    ),
    Case(
        "latitude and longitude",
        "id,ability,Latitude,Longitude\na,1,59.9,10.7\n",
        "id,workload,LAT,LNG,Altitude (ft)\nt1,5,60.1,-0.5,1000\n",
        fields={"metric": "geographic", "agent_position": [[10.7, 59.9, 0]], "task_position": [[-0.5, 60.1, 304.8]]},
    ),
    Case(
        "decimal commas with three digits",
        "id;ability;Breite;Länge\na;1;47,123;8,456\n",
        fields={"agent_position": [[8.456, 47.123, 0]]},
    ),
    Case(
        "where agents begin",
        "id,ability,Home lat,Home lon\na,1,50.5,4.5\n",
        fields={"agent_position": [[4.5, 50.5, 0]], "metric": "geographic"},
    ),
    Case(
        "where agents begin, in German",
        "Drohnen-ID;Nutzlast;Standort Lat;Standort Lon\na;1;50,5;4,5\n",
        "id,workload,lat,lon,elevation_ft\nt1,5,50,4,100\n",
        fields={"agent_position": [[4.5, 50.5, 0]], "task_position": [[4, 50, 30.48]]},
        lines=("tasks.csv: elevation_ft -> z in m, times 0.3048",),
    ),
    Case(
        "places of tasks alone",
        tasks="id,workload,lat,lon\nt1,5,50,4\n",
        fields={"task_position": [[4, 50, 0]]},
        lines=("agents.csv: no column gives the places of the agents, so that all distances are 0",),
    ),
    Case(
        "GPS in one column",
        'id,ability,GPS\na,1,"47.1, 8.5"\nb,1,47.2 8.6\n',
        fields={"agent_position": [[8.5, 47.1, 0], [8.6, 47.2, 0]], "metric": "geographic"},
    ),
    Case(
        "degrees, minutes and seconds",
        "id;ability;lat;lon\na;1;47°30'00\"N;8°15'W\n",
        fields={"agent_position": [[-8.25, 47.5, 0]]},
    ),
    Case(
        "position in one column",
        'id,ability,Position\na,1,"(1.5, 2, 3)"\n',
        fields={"agent_position": [[1.5, 2, 3]], "metric": "euclidean"},
    ),
    Case(
        "coordinates of either kind",
        'id,ability,Location\na,1,"47.1, 8.5"\n',
        error="agents.csv: column 'Location': may be latitude and longitude, or x and y;"
        " specify it by --map gps=Location or --map position=Location",
    ),
    Case(
        "coordinates of either kind, and the user's choice",
        'id,ability,Location\na,1,"47.1, 8.5"\n',
        options={"columns": {"gps": "Location"}},
        fields={"metric": "geographic", "agent_position": [[8.5, 47.1, 0]]},
    ),
    Case(
        "degrees here, a plane there",
        "id,ability,lat,lon\na,1,47.1,8.5\n",
        "id,workload,x,y\nt1,5,1,2\n",
        error="tasks.csv: gives places by x and y, but agents.csv by latitude and longitude; use the same in both",
    ),
    Case(
        "swapped degrees",
        "id,ability,lat,lon\na,1,147.1,8.5\n",
        error="agents.csv: line 2: latitude 147.1 and longitude 8.5 are not on earth; swapped, or x and y?",
    ),
    Case(
        "east as a latitude",
        "id,ability,lat,lon\na,1,8.5 E,47.1 N\n",
        error="agents.csv: line 2, column 'lat': must be a number, got '8.5 E'",
    ),
    Case(
        "position in one column, in m here and in km there",
        "id;ability;Position [km]\na;1;1,5 2\n",
        "id,workload,x (m),y (m),z\nt1,5,1000,0,7\n",
        options={"units": Units(distance="km")},
        fields={"agent_position": [[1.5, 2, 0]], "task_position": [[1, 0, 0.007]], "units.distance": "km"},
    ),
    Case(
        "one base for all",
        tasks="id,workload,lat,lon\nt1,5,50,4\n",
        options={"columns": {"agents.lat": "51", "agents.lon": "5"}},
        fields={"agent_position": [[5, 51, 0], [5, 51, 0]], "metric": "geographic"},
    ),
    Case(
        "latitude alone",
        "id,ability,lat\na,1,47.1\n",
        error="agents.csv: 'lat' is there, but no column for lon; add it, or --map lon=COLUMN",
    ),
    Case(
        "half a place",
        "id,ability,x,y\na,1,3,\n",
        error="agents.csv: line 2: has one coordinate without the other; fill in both or none",
    ),
    Case(
        "both kinds of places",
        "id,ability,x,y,lat,lon\na,1,3,4,47,8\n",
        options={"columns": {"lat": "lat"}},
        fields={"metric": "geographic", "agent_position": [[8, 47, 0]]},
    ),
]

DISTANCES = [
    Case(
        "rows",
        distances="from;to;km\na1;t1;3,5\na2;t2;4\n",
        fields={"distances": [("a1", "t1", 3.5), ("a2", "t2", 4)], "missing": "unreachable", "units.distance": "km"},
    ),
    Case(
        "matrix",
        distances=",t1,t2\na1,3.5,1\na2,,4\n",
        fields={"distances": [("a1", "t1", 3.5), ("a1", "t2", 1), ("a2", "t2", 4)]},
    ),
    Case(
        "matrix of all",
        distances=";a1;a2;t1;t2\na1;0;1;2;3\na2;1;0;4;5\n",
        fields={"distances": [("a1", "t1", 2), ("a1", "t2", 3), ("a2", "t1", 4), ("a2", "t2", 5)]},
        lines=("distances.csv: 4 distances between agents, or from an id to itself, are left out",),
    ),
    Case(
        "ids of an agent and of a task",
        "id,ability\n1,4\n",
        "id,workload\n1,5\n",
        distances="agent,task,km\n1,1,3\n",
        error="distances.csv: line 2: '1' is the id of an agent and of a task; give them different ids",
    ),
    Case(
        "the same pair twice",
        distances="from,to,distance\na1,t1,3\na2,t1,3\na1,t1,4\n",
        error="distances.csv: line 4: gives a pair that an earlier row gives; keep one of them",
    ),
    Case(
        "matrix with closed roads",
        "id,ability,x,y\na1,4,0,0\n",
        "id,workload,x,y\nt1,5,1,1\nt2,7,2,2\n",
        distances="from\\to,t1,t2\na1,3.5,∞\n",
        fields={"distances": [("a1", "t1", 3.5)], "missing": "unreachable"},
    ),
    Case(
        "matrix between places",
        "id,ability,x,y\na1,4,0,0\n",
        "id,workload,x,y\nt1,5,1,1\nt2,7,2,2\n",
        distances=",t1,t2\na1,3.5,\n",
        fields={"distances": [("a1", "t1", 3.5)], "missing": "metric"},
    ),
    Case(
        "unknown id",
        distances="from,to,distance\na1,t1,3\na1,t3,4\n",
        error="distances.csv: line 3: there is no agent or task 't3' (known: a1, a2, t1, t2)",
    ),
    Case(
        "no distances",
        distances="foo,bar\n1,2\n",
        error="distances.csv: is not a table of distances;"
        " it needs the columns from, to and distance, or a column for each id",
    ),
]

WORKBOOKS = [
    Case(
        "plain workbook",
        [["Drone", "Payload [kg]", "Skills"], ["d1", 4, "camera"], ["d2", 2.5, None]],
        [["Task", "Load"], [1, 5], [2, 7.0]],
        fields={"agent_ids": ("d1", "d2"), "ability": [4, 2.5], "task_ids": ("1", "2"), "skills": (("camera",), ())},
    ),
    Case(
        "named sheet, a title, and numbers as text",
        [["Fleet"], [None], ["Drone", "Payload"], ["d1", "4,5"], ["Total", 4.5]],
        sheet="Drones",
        fields={"agent_ids": ("d1",), "ability": [4.5]},
    ),
    Case(
        "merged headers in two rows",
        [["id", "ability", "Position", None], [None, None, "x", "y"], ["d1", 4, 1, 2]],
        merged=("A1:A2", "B1:B2", "C1:D1"),
        fields={"agent_position": [[1, 2, 0]]},
    ),
    Case(
        "merged headers with units below",
        [["Drone", "Payload", "Position", None], [None, "kg", "x [km]", "y [km]"], ["d1", 4, 1, 2]],
        merged=("C1:D1",),
        fields={"agent_ids": ("d1",), "units.work": "kg", "units.distance": "km", "agent_position": [[1, 2, 0]]},
    ),
    Case(
        "a first column that is empty, and a title over all",
        [["Fleet"], [None, "Drone", "Battery %", "Payload"], [None, "d1", 80, 4], [None, "Total", 80, 4]],
        merged=("A1:D1",),
        options={"units": Units(energy="%")},
        fields={"agent_ids": ("d1",), "battery": [80], "units.energy": "%"},
    ),
    Case(
        "rows of sections",
        [["Drone", "Payload"], ["North", None], ["d1", 4]],
        error="agents.xlsx: row 2, column 'Payload': has no ability; fill it in, or leave the row out",
    ),
    Case(
        "merged cells below each other",
        [["id", "ability", "speed"], ["d1", 4, 30], ["d2", 2, None], ["d3", 1, 20]],
        merged=("C2:C3",),
        fields={"speed": [30, 30, 20]},
    ),
    Case(
        "merged abilities",
        [["id", "ability"], ["d1", 4], ["d2", None]],
        merged=("B2:B3",),
        error="agents.xlsx: row 2, column 'ability': is merged: one value for each or for all? Unmerge the cells",
    ),
    Case(
        "yes and no as values",
        [["id", "ability", "Returns"], ["d1", 4, True], ["d2", 2, False]],
        fields={"returns": [True, False]},
    ),
    Case(
        "a number that became a date",
        [["id", "ability"], ["d1", datetime(2026, 5, 1)]],
        error="agents.xlsx: row 2, column 'ability': is a date (2026-05-01 00:00:00);"
        " write a number, in a cell formatted as a number",
    ),
]

PERCENT = (
    "is in percent, but the capacity is unknown; add a column such as 'Battery capacity [Wh]', or name one "
    "with the energy by --map battery=...; if consumption is in percent, too, give --units energy=%"
)

ENERGIES = [
    Case(
        "what is used per distance, by its unit",
        "id,ability,battery [Wh],use [Wh/km]\na,1,700,20\nb,1,900,\n",
        fields={"agent_energy_per_distance": [20, 1], "units.energy": "Wh", "units.distance": "km"},
        lines=("agents.csv: use [Wh/km] -> energy_per_distance",),
    ),
    Case(
        "use and battery in two units",
        "id,ability,battery [kWh],draw_Wh/km\na,1,0.7,20\n",
        fields={"agent_energy_per_distance": [20], "battery": [700], "units.energy": "Wh"},
    ),
    Case(
        "batteries in percent of nothing",
        "id,ability,battery [%]\na,1,80\n",
        error=f"agents.csv: column 'battery [%]': {PERCENT}",
    ),
    Case(
        "batteries in percent of a capacity",
        "id,ability,battery [%],battery capacity [Wh]\na,1,80,500\nb,1,,500\n",
        fields={"battery": [400, INF], "units.energy": "Wh"},
        lines=(
            "agents.csv: battery [%] is a percentage of battery capacity [Wh]",
            "agents.csv: battery capacity [Wh] -> capacity of the battery",
        ),
    ),
    Case(
        "batteries and consumption in percent",
        "id,ability,battery [%],consumption [%/km]\na,1,80,2\n",
        fields={"battery": [80], "agent_energy_per_distance": [2], "units.energy": "%"},
    ),
    Case(
        "capacity in energy beside a load",
        "id,payload [kg],capacity [Wh]\na,4,500\n",
        fields={"ability": [4], "battery": [500], "units.energy": "Wh"},
    ),
    Case(
        "longitudes to the east of the date line",
        "id,ability,lat,lon\na,1,52,190.5\nb,1,52,-170\n",
        fields={"agent_position": [[-169.5, 52, 0], [-170, 52, 0]]},
        lines=("agents.csv: longitudes beyond 180 are west: 190.5 is -169.5",),
    ),
    Case(
        "units in the name and in the row below",
        "id,ability,range [km]\n,,[km]\na,1,5\n",
        fields={"communication_range": [5], "units.distance": "km"},
        lines=("agents.csv: range [km] -> range",),
    ),
    Case(
        "bases to return to",
        "id,ability,x,y,returns to\na,1,0,0,North\nb,1,1,0,yes\nc,1,2,0,\n",
        "id,workload,x,y\nt1,5,1,1\n",
        bases="Base;x;y\nNorth;0,5;2\n",
        distances="from,to,distance\na,t1,3\nt1,North,4\nNorth,a,9\n",
        fields={
            "returns": [True, True, False],
            "return_base": [0, -1, -1],
            "bases": {"North": [0.5, 2, 0]},
            "distances": [("a", "t1", 3), ("t1", "North", 4)],
        },
    ),
    Case(
        "a base that is not among the bases",
        "id,ability,x,y,home base\na,1,0,0,South\n",
        "id,workload,x,y\nt1,5,1,1\n",
        bases="Base,x,y\nNorth,0,2\n",
        error="agents.csv: line 2, column 'home base': must be yes, no or the id of a base, got 'South'; "
        "give the bases with --bases",
    ),
    Case(
        "bases in a plane among places on earth",
        "id,ability,lat,lon\na,1,0,0\n",
        bases="Base,x,y\nNorth,0,2\n",
        error="bases.csv: gives places by x and y, but agents.csv by latitude and longitude; use the same in both",
    ),
]

TEXTS = [*ENERGIES, *SEPARATORS_AND_ENCODINGS, *NUMBERS, *HEADERS, *ROWS, *VALUES, *PLACES, *DISTANCES]
