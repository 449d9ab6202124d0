"""INS errors estimated against GNSS, and their forecast without it: system 2.

Source: Neusypin, Smolkin, Kharin, 2003.
"""
