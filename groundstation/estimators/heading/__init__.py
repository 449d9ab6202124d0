"""INS heading error from straight taxi before take-off: system 1.

Source: Markelov, Kostishin, Shukalov, 2015.
"""
