"""The verb on folders of flights: ``serve`` offers their recordings to a team."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.application import DONE, Verbose, answers_with_exit_code, app, examples, say


@app.command(epilog=examples("serve"))
@answers_with_exit_code
def serve(
    out: Annotated[Path, typer.Argument(help="A folder that `run` made.", metavar="OUT", readable=False)],
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", help="Port; 0: any free one.", min=0, max=65535)] = 51234,
    web: Annotated[bool, typer.Option("--web", help="Serve the viewer to a browser too.")] = False,
    verbose: Verbose = False,
) -> int | None:
    """Offer all recordings of a folder through Rerun's catalog server, until Ctrl-C."""
    from groundstation.pipeline.verbs.serve import serve as offer

    offer(out, host=host, port=port, web=web, tell=typer.echo, say=say)
    return DONE
