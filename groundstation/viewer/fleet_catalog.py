"""Catalog of recordings on Rerun's own server.

Each data set has the layout that its recordings embed.
"""

import socket
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import rerun as rr
from rerun.catalog import DatasetEntry
from rerun.chunk import RrdReader
from rerun.server import Server

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.viewer.catalog_table import save_flight_table
from groundstation.viewer.fleet import FLEET, FLIGHTS_TEXT
from groundstation.viewer.gate import GateServer, hidden_address
from groundstation.viewer.inner import catalog_client
from groundstation.viewer.recording import open_stream
from groundstation.viewer.verification import damaged

FLIGHTS, SESSIONS = "flights", "sessions"
VIEWS = "/view/"  # where a layout keeps its views
LINKS_LAYER = "links"
MOST_LAYOUTS = 16  # looked at, some 0.1 s each
FAULTS = (ValueError, RuntimeError, OSError)  # what Rerun raises over a damaged file


@dataclass(frozen=True)
class Catalog:
    """A running catalog.

    Parameters
    ----------
    url : str
        Where clients and viewers find it: ``rerun+http://host:port``.
    table_url : str
        Where a viewer opens on the table of flights.
    flights : tuple of str
        Segment ids of the data set ``flights``: flight ids.
    sessions : tuple of str
        The same of ``sessions``, a data set of its own as its layout is: session ids.
    has_fleet : bool
        Whether there is a data set ``fleet``.
    refused : tuple of (Path, str)
        Recordings that the server could not read, and why.
    """

    url: str
    table_url: str
    flights: tuple[str, ...]
    sessions: tuple[str, ...]
    has_fleet: bool
    refused: tuple[tuple[Path, str], ...]


@contextmanager
def catalog_server(
    flights: Sequence[Path], fleet: Path | None, *, host: str, port: int, sessions: Sequence[Path] = ()
) -> Iterator[Catalog]:
    """Serve recordings as data sets until the context is left.

    The data sets are ``flights``, ``sessions`` (where any are) and ``fleet``.

    Raises
    ------
    GroundstationError
        When the port is taken or the address is not of this machine.
    """
    with _behind_a_gate(host, port) as (server, url), tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        client = catalog_client(server.url())
        segments: dict[str, tuple[str, ...]] = {SESSIONS: ()}
        links: dict[str, str] = {}
        refused: list[tuple[Path, str]] = []
        for name, paths in {FLIGHTS: flights, **({SESSIONS: sessions} if sessions else {})}.items():
            dataset = client.create_dataset(name)
            offered, problems = _register(dataset, paths)
            _lay_out_table(dataset, Path(folder) / f"{name}.rbl")
            refused += problems
            segments[name] = tuple(sorted(offered))
            links |= {one: dataset.segment_url(one).replace(server.url(), url) for one in offered}
        table_url = f"{url}/entry/{client.get_dataset(FLIGHTS).id}"
        has_fleet = False
        if fleet is not None:
            dataset = client.create_dataset(FLEET)
            offered, problems = _register(dataset, [fleet])
            refused += problems
            has_fleet = bool(offered)
            if has_fleet:
                _link(dataset, fleet, links, Path(folder) / "links.rrd")
        yield Catalog(url, table_url, segments[FLIGHTS], segments[SESSIONS], has_fleet, tuple(refused))


@contextmanager
def _behind_a_gate(host: str, port: int) -> Iterator[tuple[Server, str]]:
    """Start Rerun's server on a secret address, and return it with the gate's address.

    Others know only the address of the gate.
    """
    try:
        entry = GateServer(host, port)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise GroundstationError(f"{host}:{port}", reason, next_step="choose another --port or --host") from error
    with entry.listening(), Server(host=hidden_address(), port=0) as server:
        inner = urlsplit(server.url().removeprefix("rerun+"))
        entry.open(str(inner.hostname), int(inner.port or 0))
        shown = f"[{host}]" if ":" in host else host
        yield server, reachable(f"rerun+http://{shown}:{entry.port}")


def reachable(url: str) -> str:
    """Return the address that others can use.

    A server on all addresses has the name of its machine.

    Examples
    --------
    >>> reachable("rerun+http://127.0.0.1:51234")
    'rerun+http://127.0.0.1:51234'
    """
    for wildcard in ("//0.0.0.0:", "//[::]:"):
        url = url.replace(wildcard, f"//{socket.gethostname()}:")
    return url


def _register(dataset: DatasetEntry, paths: Sequence[Path]) -> tuple[dict[str, Path], list[tuple[Path, str]]]:
    """Register recordings, except damaged ones.

    Returns segment ids with their files, and refused files with the reason.
    """
    faults = damaged(paths)
    by_uri = {path.absolute().as_uri(): path for path in paths if path not in faults}
    offered: dict[str, Path] = {}
    refused = list(faults.items())
    batches = [list(by_uri)] if by_uri else []
    while batches:
        batch = batches.pop()
        try:
            results = list(dataset.register(batch).iter_results())
        except FAULTS as error:  # one unreadable file refuses its whole batch
            if len(batch) == 1:
                refused.append((by_uri[batch[0]], str(error).splitlines()[0]))
            else:
                middle = len(batch) // 2
                batches += [batch[middle:], batch[:middle]]
            continue
        offered |= {one.segment_id: by_uri[one.uri] for one in results if one.is_success}
        refused += [(by_uri[one.uri], str(one.error).splitlines()[0]) for one in results if one.is_error]
    _lay_out(dataset, offered.values())
    return offered, refused


def _lay_out(dataset: DatasetEntry, recordings: Iterable[Path]) -> None:
    """Give a data set its layout, that of its fullest recording.

    A data set can have only one; the fullest serves the most flights.
    """
    largest = sorted(recordings, key=lambda path: path.stat().st_size)[-MOST_LAYOUTS:]
    views = {path: _views(path) for path in largest}
    if any(views.values()):
        dataset.register_blueprint(max(largest, key=lambda path: views[path]).absolute().as_uri())


def _lay_out_table(dataset: DatasetEntry, layout: Path) -> None:
    """Give the table of a data set its columns and cards."""
    save_flight_table(layout, dataset.schema().to_arrow().names)
    dataset.register_blueprint(layout.absolute().as_uri(), segment_table=True)


def _views(path: Path) -> int:
    """Return the number of views in the layout of a recording; none in a damaged one."""
    try:
        reader = RrdReader(path)
        entities = {chunk.entity_path for store in reader.blueprints() for chunk in reader.stream(store=store)}
    except FAULTS:
        return 0
    return sum(entity.startswith(VIEWS) and entity.count("/") == VIEWS.count("/") for entity in entities)


def _link(dataset: DatasetEntry, fleet: Path, links: dict[str, str], layer: Path) -> None:
    """Point the links in the table of flights into the catalog.

    The new text is a layer over the text that the file holds.
    """
    text = _text(fleet)
    for name, url in links.items():
        text = text.replace(f"]({name}/{name}.rrd)", f"]({url})")
    if not text:
        return
    with open_stream(FLEET) as stream:
        stream.save(layer)
        stream.log(FLIGHTS_TEXT, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    dataset.register([layer.absolute().as_uri()], layer_name=LINKS_LAYER).wait()


def _text(fleet: Path) -> str:
    """Return the table of flights in the recording of a fleet.

    Empty without one, or for a damaged file.
    """
    try:
        for chunk in RrdReader(fleet).stream():
            if chunk.entity_path == f"/{FLIGHTS_TEXT}":
                return str(chunk.to_record_batch().column("TextDocument:text")[0].as_py()[0])
    except (*FAULTS, KeyError):
        pass
    return ""
