"""System 2: INS errors estimated against GNSS, and their forecast without it (Neusypin, Smolkin, Kharin, 2003)."""
